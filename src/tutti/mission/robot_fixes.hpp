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

/// Adds the fixes of the robot's file, or else of its bag (`bag` may be null), to the recording, with a note on what
/// was used. Fails when the file is invalid, or by another clock than the odometry.
Status take_fixes(const RobotConfig& robot, const std::filesystem::path& data, const BagRecording* bag,
                  const Trajectory& odometry, MissionRecording& out);

}  // namespace tutti::mission
