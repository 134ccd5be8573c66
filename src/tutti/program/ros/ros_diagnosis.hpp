// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/ros_encode.hpp"
#include "tutti/intake/ros_intake.hpp"

namespace tutti::ros {

/// The state of a robot on ROS's topics.
struct RosSituation {
  std::string name;
  bool is_connected = false;  ///< To the robot's live feed.
  intake::RosIntake::Counts counts;
  bool in_map = false;
  std::vector<std::pair<std::string, std::string>> status;  ///< The robot's own report.
  std::vector<std::string> alerts, troubles;  ///< The robot's alerts, and problems with its messages, the newest last.
};
/// The message for /diagnostics.
bags::RosDiagnostic diagnosis(const RosSituation& situation);

}  // namespace tutti::ros
