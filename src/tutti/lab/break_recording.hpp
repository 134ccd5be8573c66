// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::lab {

/// A mistake that people make when they set a robot up, or a way in which its odometry fails.
struct RobotMistake {
  std::string_view name, help;
  void (*make)(Recording& recording, double times);  ///< So many times as large as `help` says, where it has a size.
};
const std::vector<RobotMistake>& robot_mistakes();

/// Which robot of a mission is set up wrongly.
struct MistakeConfig {
  std::string robot;
  std::string kind = "scans_late";
  double times = 1.0;
  template <class V>
  void describe(V& v) {
    v.field("robot", robot, any(), "Name of the robot.");
    v.field("kind", kind, one_of(names_of(robot_mistakes())), help_of(robot_mistakes()) + ".");
    v.field("times", times, between(-10.0, 10.0), "So many times as large, where the kind has a size.");
  }
};

/// Makes the mistakes; an error when no robot is called so.
Status make_mistakes(const std::vector<MistakeConfig>& mistakes, const std::vector<Recording*>& robots);

}  // namespace tutti::lab
