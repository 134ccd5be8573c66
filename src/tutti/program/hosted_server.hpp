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
#include "tutti/program/radio_count.hpp"

namespace tutti::program {

/// A server as its host sees it. Maps are made on a second thread, one at a time, so that no submap, receipt or job
/// waits for one. The CPU time of that thread is what the node paces its updates by.
class HostedServer final : public Hosted {
 public:
  /// Called on the second thread; what it throws is thrown by work().
  using MakeMap = std::function<node::MapOfTask(node::MapTask)>;

  /// `map` is the node's store; `trouble` is what is wrong with the program. `is_over`: the mission is another
  /// server's. All must outlive this.
  HostedServer(std::unique_ptr<node::ServerNode> node, const storage::TableStore& map, std::string version,
               std::function<std::string(const MissionStatus&)> trouble, const bool& is_over,
               const std::vector<std::unique_ptr<MapViewer>>& viewers, const Clock& clock,
               MakeMap make_map = &node::make_map);
  Answer start(Timestamp now) override { return counted({node_->resume(now), {}}); }
  Answer receive(const bus::Received& message, Timestamp now) override {
    radio_.count(message.envelope);
    return counted({node_->receive(message.envelope, now), {message.ticket}});
  }
  Answer put_aside(const bus::Received& message, const std::string& why, Timestamp now) override {
    return {node_->put_aside(message.envelope, why, now), {message.ticket}};
  }
  [[nodiscard]] std::optional<Timestamp> next_work() const override;
  Answer work(Timestamp now) override;
  Answer report(Timestamp now) override { return {{.messages = {mission_status(now)}}, {}}; }
  [[nodiscard]] Json status(Timestamp now) const override;
  [[nodiscard]] bool finished() const override { return is_over_; }
  /// Viewers that have time for a new map get it.
  void wait(double wall_s) override;
  /// The map that is being made is still sent.
  Answer end() override;

 private:
  bus::Envelope mission_status(Timestamp now);
  Answer counted(Answer answer) {
    for (const bus::Envelope& message : answer.step.messages) radio_.count(message);
    return answer;
  }
  void tend_viewers(Timestamp now);
  [[nodiscard]] bool is_made() const;

  std::unique_ptr<node::ServerNode> node_;
  mapfile::ShownMaps shown_maps_;
  std::string version_;
  std::function<std::string(const MissionStatus&)> trouble_;
  const bool& is_over_;
  const std::vector<std::unique_ptr<MapViewer>>& viewers_;
  const Clock& clock_;
  MakeMap make_map_;
  RadioCount radio_;
  std::uint64_t reported_changes_ = 0;
  std::future<node::MapOfTask> making_;  // valid while a map is made; its destructor waits
};

}  // namespace tutti::program
