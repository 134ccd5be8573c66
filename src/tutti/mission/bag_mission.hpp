// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::mission {

/// The mission file of `tutti run --bag`: one robot per bag, LiDAR closures, and defaults for everything else. `bags`
/// are "alpha=recordings/alpha"; `topics` are "alpha.scans=/points", for odometry, scans, images, depth, imu or
/// fixes. Fails with the word that is not understood.
Result<std::string> bag_mission(const std::vector<std::string>& bags, const std::vector<std::string>& topics);

}  // namespace tutti::mission
