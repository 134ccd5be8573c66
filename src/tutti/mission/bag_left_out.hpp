// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/mission/bag_index.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/mission/mission_config.hpp"

namespace tutti::mission {

/// The odometry that was taken of a bag, and the name of its topic or pair of frames.
struct TakenOdometry {
  const std::string& topic;
  const OdometryTrack& track;
};

/// Where more than a tenth of a bag's odometry, scans, images or fixes is left out, or no sensor saw anything for that
/// share of the odometry's time: a sentence each, with the share, why, and what to type. `bag` has what was taken.
std::vector<std::string> much_left_out(const BagIndex& index, const TakenOdometry& odometry, const BagRecording& bag,
                                       const RobotConfig& robot);

}  // namespace tutti::mission
