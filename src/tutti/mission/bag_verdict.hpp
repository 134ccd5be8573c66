// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace tutti::mission {

/// Whether `tutti run` can go with a bag, as load_input(), which it begins with, finds it: "ready: LINE", or
/// "not ready: WHY". The line is to be typed as it is.
struct BagVerdict {
  bool is_ready = false;
  std::string text;
  std::vector<std::string> warnings;  ///< Those that the mission would begin with.
};

/// `robots`: the namespaces with odometry, of which each is a robot; none: the bag is one robot's.
BagVerdict judge_bag(const std::filesystem::path& bag, const std::set<std::string>& robots);

}  // namespace tutti::mission
