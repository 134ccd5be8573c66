// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::mission {

/// Adds what the robot's bag has measured (`bag` may be null) to the recording, with the fixes of its file, where it
/// has one, in the place of the bag's, and a note on which were used. Fails when the file is invalid, or by another
/// clock than the odometry.
Status take_measured(const RobotConfig& robot, const std::filesystem::path& data, const BagRecording* bag,
                     const Trajectory& odometry, MissionRecording& out);

}  // namespace tutti::mission
