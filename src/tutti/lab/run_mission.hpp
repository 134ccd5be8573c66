// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/mission/runner.hpp"

namespace tutti::lab {

/// Runs a mission file by mission::run_mission(): simulates its robots or reads their recordings, and adds what the
/// laboratory spoils and compares. Its robots have numbers that options.map has free.
Result<mission::MissionRecord> run_mission(const MissionConfig& config, mission::RunOptions options);

}  // namespace tutti::lab
