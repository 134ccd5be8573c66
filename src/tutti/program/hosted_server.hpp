// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/node/server_node.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/map_viewer.hpp"

namespace tutti::program {

/// The server's node in a program, with viewers that show its map.
class HostedServer final : public Hosted {
 public:
  HostedServer(std::unique_ptr<node::ServerNode> node, std::string version, std::function<std::string()> trouble,
               const bool& is_over, const std::vector<std::unique_ptr<MapViewer>>& viewers, const Clock& clock)
      : node_(std::move(node)),
        version_(std::move(version)),
        trouble_(std::move(trouble)),
        is_over_(is_over),
        viewers_(viewers),
        clock_(clock) {}
  Answer start(Timestamp now) override { return counted({node_->resume(now), {}}); }
  Answer receive(const bus::Received& message, Timestamp now) override {
    radio_.count(message.envelope);
    return counted({node_->receive(message.envelope, now), {message.ticket}});
  }
  Answer put_aside(const bus::Received& message, const std::string& why, Timestamp now) override {
    return {node_->put_aside(message.envelope, why, now), {message.ticket}};
  }
  [[nodiscard]] std::optional<Timestamp> next_work() const override {
    return asked_.empty() ? node_->next_timer() : kFirstTimestamp;
  }
  Answer work(Timestamp now) override {
    Answer answer;
    for (AskedWord& word : std::exchange(asked_, {})) take(word, now, answer.step);
    answer.step.add(node_->on_timer(now));
    if (node_->changes() != told_changes_) answer.step.messages.push_back(mission_status(now));
    return counted(std::move(answer));
  }
  Answer report(Timestamp now) override { return {{.messages = {mission_status(now)}}, {}}; }
  [[nodiscard]] Json status(Timestamp now) const override;
  [[nodiscard]] bool finished() const override { return is_over_; }
  /// Viewers that have time for a new map get it, and what operators decided there is work for the next turn.
  void wait(double wall_s) override {
    tend_viewers(clock_.now());
    Hosted::wait(asked_.empty() ? wall_s : 0.0);
  }

 private:
  bus::Envelope mission_status(Timestamp now);
  Answer counted(Answer answer) {
    for (const bus::Envelope& message : answer.step.messages) radio_.count(message);
    return answer;
  }
  void tend_viewers(Timestamp now);
  /// As if it had come by the bus.
  void take(AskedWord& asked, Timestamp now, node::Step& step);

  std::unique_ptr<node::ServerNode> node_;
  std::string version_;
  std::function<std::string()> trouble_;
  const bool& is_over_;
  const std::vector<std::unique_ptr<MapViewer>>& viewers_;
  const Clock& clock_;
  RadioCount radio_;
  std::vector<AskedWord> asked_;
  /// Answers to words whose step is being carried out.
  std::vector<std::pair<std::promise<std::string>, std::string>> answers_;
  std::uint64_t told_changes_ = 0;
  std::uint64_t asked_words_ = 0;  // so many so far
};

}  // namespace tutti::program
