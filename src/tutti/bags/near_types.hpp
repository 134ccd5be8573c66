// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/bags/bag_info.hpp"

namespace tutti::bags {

/// Which program makes of this type one that Tutti reads, or what is to be recorded instead; empty for a type that is
/// read, and for one that has nothing of interest. By ROS 2's name or ROS 1's.
std::string_view way_on(std::string_view type);

/// A line for every topic with messages whose type has a way_on(): "near  /packets (velodyne_msgs/msg/..): .."
std::vector<std::string> near_types(const BagInfo& info);

}  // namespace tutti::bags
