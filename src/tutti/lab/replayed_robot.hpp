// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/mission/robot_actor.hpp"
#include "tutti/program/robot_driver.hpp"

namespace tutti::lab {

/// A mission's robot in a program of its own, with the samples of its recording.
class ReplayedRobot final : public program::RobotDriver {
 public:
  explicit ReplayedRobot(std::unique_ptr<mission::RobotActor> actor) : actor_(std::move(actor)) {}
  [[nodiscard]] const node::RobotNode& node() const override { return actor_->node(); }
  void resume(Timestamp now) override { actor_->resume(now); }
  void on_timer(Timestamp now) override { actor_->on_timer(now); }
  void receive(const bus::Envelope& envelope, Timestamp now) override { actor_->receive(envelope, now); }
  void finish(Timestamp now) override { actor_->finish(now); }
  void store_all() override { actor_->store_all(); }
  node::Step take_step() override { return actor_->take_step(); }
  [[nodiscard]] double next_time() const override { return actor_->next_time(); }
  void replay_next(Timestamp now) override { actor_->replay_next(now); }
  /// How each update went, by the reference, and how long it took: for the report of whoever collects the mission.
  std::vector<program::Json> take_notes() override;

 private:
  std::unique_ptr<mission::RobotActor> actor_;
  std::size_t scored_ = 0, timed_ = 0;  // updates that have their note
};

}  // namespace tutti::lab
