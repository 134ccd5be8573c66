// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace tutti::mission {

/// Whether `tutti run` can go with a bag, as read_bag() finds it: "ready: LINE", or "not ready: WHY". The line is to be
/// typed as it is.
struct BagVerdict {
  bool is_ready = false;
  std::string text;
};

/// `robots`: the namespaces with odometry, of which each is a robot; none: the bag is one robot's.
BagVerdict judge_bag(const std::filesystem::path& bag, const std::set<std::string>& robots);

}  // namespace tutti::mission
