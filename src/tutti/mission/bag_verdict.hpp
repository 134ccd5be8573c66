// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::mission {

/// Whether `tutti run` can go with a bag, as load_input(), which it begins with, finds it: "ready: LINE", or
/// "not ready: WHY". The line is to be typed as it is.
struct BagVerdict {
  bool is_ready = false;
  std::string text;
  std::vector<std::string> warnings;  ///< Those that the mission would begin with.
  MissionConfig mission;              ///< That the line runs, when ready,
  MissionInput input;                 ///< and its recordings.
};

/// `robots`: the namespaces with odometry, of which each is a robot; none: the bag is one robot's.
BagVerdict judge_bag(const std::filesystem::path& bag, const std::set<std::string>& robots);

/// Whether the robots of a bag that is ready fit themselves: what their scans say of odometry, mounting and clock
/// (fit_alone()). A line for each contradiction, or one for a robot that has none.
struct BagCheck {
  bool fits = true;
  std::vector<std::string> lines;
};
BagCheck check_bag(const BagVerdict& verdict, const std::function<bool(double share)>& stop);

}  // namespace tutti::mission
