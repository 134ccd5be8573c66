// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::lab {

/// Simulates every robot of the mission, or reads its recording and changes it by the mission's settings. `data` is the
/// --data folder (empty for simulated robots). Fails when a recording cannot be read, or a planted closure names a
/// robot that the mission does not have.
Result<mission::MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data,
                                         std::uint64_t seed);

/// Adds the position fixes of the mission's simulated receivers to `robots`, by their references. Fails when a robot
/// has no reference, or a receiver names no robot.
Status add_fixes(const MissionConfig& config, std::uint64_t seed, const std::vector<Recording*>& robots);

/// Adds the ranges that the mission's simulated radios measure between `robots`, whose references are in one frame and
/// by one clock. Fails when a robot has no reference.
Status add_ranges(const MissionConfig& config, std::uint64_t seed, const std::vector<Recording*>& robots);

}  // namespace tutti::lab
