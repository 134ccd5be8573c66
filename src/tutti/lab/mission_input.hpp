// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::lab {

/// Simulates every robot of the mission, or reads its recording and changes it as the mission says. `data` is the
/// --data folder (may be empty for simulated robots). Planted closures name robots of the mission, or it is an error.
Result<mission::MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data,
                                         std::uint64_t seed);

}  // namespace tutti::lab
