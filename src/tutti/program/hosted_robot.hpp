// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bus/port.hpp"
#include "tutti/drive/replay.hpp"
#include "tutti/program/fed_robot.hpp"
#include "tutti/program/feed/live_feed.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/robot_program.hpp"

namespace tutti::program {

/// A robot in its program, whose samples come from its recording or from a live feed.
class HostedRobot final : public Hosted {
 public:
  /// For a map with all of its submaps, after the server has stored them.
  static constexpr double kWaitsForMap_s = 60.0;

  HostedRobot(std::unique_ptr<node::RobotNode> node, const RobotOptions& options, const Clock& clock,
              const bus::Port& port, EventLog& log, const std::string& alone, const MapFetcher* maps)
      : driver_(std::move(node)),
        options_(options),
        clock_(clock),
        port_(port),
        log_(log),
        alone_(alone),
        maps_(maps),
        begin_s_(clock.wall_s()) {
    const RobotReplay& replay = options.replay;
    if (replay.recording) replay_.emplace(*replay.recording, replay.start_s, driver_);
  }
  /// From now on samples come from the clients of `feed`.
  void feed_live(LiveFeed& feed, Host& host, RobotView view) {
    feed_ = &feed;
    fed_.emplace(feed.front(), driver_, host, clock_, std::move(view), options_.settings.tracking.tracker);
  }

  Answer start(Timestamp now) override {
    replay_ ? replay_->resume(now) : driver_.resume(now);
    return answer_for();
  }
  Answer receive(const bus::Received& message, Timestamp now) override;
  [[nodiscard]] std::optional<Timestamp> next_work() const override;
  Answer work(Timestamp now) override;
  void wait(double wall_s) override { fed_ ? fed_->wait(wall_s) : Hosted::wait(wall_s); }
  Answer end() override {
    if (fed_) fed_->end();
    driver_.store_all();
    return answer_for();
  }
  Answer report(Timestamp now) override;
  [[nodiscard]] bool finished() const override;
  [[nodiscard]] Json status(Timestamp now) const override;
  [[nodiscard]] bool is_whole_in_map() const { return driver_.node().is_whole_in_map(); }
  /// To be called when the node is to be made anew: nothing that it heard is lost.
  [[nodiscard]] node::Step store_all() {
    driver_.store_all();
    return driver_.take_step();
  }
  /// Why this program must end: another program is this robot. Nothing when it need not.
  [[nodiscard]] const std::optional<std::string>& refused() const { return refused_; }

  /// The node's status, with this program's report of its feed.
  [[nodiscard]] NodeStatus node_status(Timestamp now) const;

 private:
  Answer answer_for(std::vector<std::uint64_t> done = {}) {
    Answer out{driver_.take_step(), std::move(done)};
    if (fed_) fed_->note(out.step);
    return out;
  }
  void note_conflict();
  [[nodiscard]] bool has_ended() const { return feed_ ? feed_->front().has_ended() : ended_; }
  [[nodiscard]] std::string progress(double time_s) const;
  [[nodiscard]] Json feed_status() const;

  drive::Driver driver_;
  std::optional<drive::Replay> replay_;  // nothing: it is fed
  const RobotOptions& options_;
  const Clock& clock_;
  const bus::Port& port_;
  EventLog& log_;
  const std::string& alone_;  // why it hears no server
  const MapFetcher* maps_;    // null: it does not localise in published maps
  double begin_s_;
  LiveFeed* feed_ = nullptr;     // null: it replays
  std::optional<FedRobot> fed_;  // the robot's end of that feed
  bool ended_ = false;           // the recording that it replays has ended
  bool warned_ = false;
  std::optional<std::string> refused_;
  mutable std::optional<double> settled_s_;
};

}  // namespace tutti::program
