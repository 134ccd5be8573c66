// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_up.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::app {

/// Runs a mission as programs of their own, by this program itself, until it has ended or `stop_asked()`, and writes
/// its report.
Status run_as_programs(lab::MissionUpOptions& options, program::Level console);

}  // namespace tutti::app
