// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/perception/fit/misfit.hpp"

namespace tutti::mission {

/// How a robot's scans and images and its odometry fit each other.
struct FitAlone {
  std::vector<fit::Misfit> misfits;
  std::uint64_t steps = 0;  ///< Motions that were compared.
};
/// Replays a robot's recording alone, without a server. `stop` is asked between samples, with the share of the
/// recording that is replayed; not set: never.
FitAlone fit_alone(const MissionRecording& recording, const MissionConfig& config,
                   const std::function<bool(double share)>& stop = {});

/// Sets clock and pose of each robot's LiDAR in `config` to what its scans say (fit_alone()), where the recording
/// lets them be set. Returns a sentence for each change; none: nothing is to be corrected.
std::vector<std::string> correct_robots(const std::vector<MissionRecording>& recordings, MissionConfig& config);

}  // namespace tutti::mission
