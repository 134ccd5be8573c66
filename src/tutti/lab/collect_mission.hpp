// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/mission/record.hpp"

namespace tutti::lab {

/// The record of a mission whose programs have ended, from their stores and events in STATE/server and
/// STATE/robots/NAME. Its only times are those that robots measured. Fails when something is missing or cannot be read.
Result<mission::MissionRecord> collect_mission(const MissionConfig& config, const MissionSource& source,
                                               const std::filesystem::path& state, const std::string& version);

}  // namespace tutti::lab
