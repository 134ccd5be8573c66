// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/mission/record.hpp"

namespace tutti::lab {

/// The record of a mission whose programs have ended, from what they left in STATE/server and STATE/robots/NAME: maps
/// and estimates from their stores, the course of the mission from their events. No timing but the robots' own.
Result<mission::MissionRecord> collect_mission(const MissionConfig& config, const MissionSource& source,
                                               const std::filesystem::path& state, const std::string& version);

}  // namespace tutti::lab
