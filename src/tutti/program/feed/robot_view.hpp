// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/consistency/alerts.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/program/feed/feed_target.hpp"

namespace tutti::program {

/// Collects from a robot's node and its events what a live feed reports of the robot.
class RobotView {
 public:
  /// `names`: of the other robots, as far as they are known.
  explicit RobotView(std::string name, std::map<RobotId, std::string> names = {})
      : name_(std::move(name)), names_(std::move(names)) {}

  /// To be called with every event of the node's steps.
  void note(const node::Event& event, const node::RobotNode& node);
  [[nodiscard]] FeedState state(const node::RobotNode& node) const;
  /// The number of the robot of this name; of one that is in no mission the number that is made from it.
  [[nodiscard]] RobotId number_of(const std::string& name) const;

 private:
  std::string name_;
  std::map<RobotId, std::string> names_;
  std::optional<Timestamp> first_;  ///< The newest sample at the first update; the times in updates_ count from it.
  std::vector<consistency::Suspicion> updates_;
  std::vector<node::RobotAlert> alerts_;             ///< Where odometry and map differ.
  std::map<std::string, node::RobotAlert> missing_;  ///< By sensor.
};

/// The number of a robot that no mission gives one, made from its name: FNV-1a of 32 bits, with the highest set.
RobotId robot_id_of(const std::string& name);

/// An error when the node refused the sample or scan that this step was about.
Status taken(const node::Step& step);

}  // namespace tutti::program
