// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::mission {

/// The mission file of `tutti run --bag`: a robot a bag, LiDAR closures, everything else as it is by default.
/// `bags`: "alpha=recordings/alpha"; `topics`: "alpha.scans=/points", of odometry, scans, images or imu. The error says
/// which of them is not understood.
Result<std::string> bag_mission(const std::vector<std::string>& bags, const std::vector<std::string>& topics);

}  // namespace tutti::mission
