// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/perception/fit/misfit.hpp"

namespace tutti::mission {

/// In what a robot's scans contradict its odometry when its recording is replayed alone, without a server. `stop` is
/// asked between samples, with the share of the recording that is replayed; not set: never.
std::vector<fit::Misfit> misfits_alone(const MissionRecording& recording, const MissionConfig& config,
                                       const std::function<bool(double share)>& stop = {});

/// Sets clock and pose of each robot's LiDAR in `config` to what its scans say (misfits_alone()), where the recording
/// lets them be set. Returns a sentence for each change; none: nothing is to be corrected.
std::vector<std::string> correct_robots(const std::vector<MissionRecording>& recordings, MissionConfig& config);

}  // namespace tutti::mission
