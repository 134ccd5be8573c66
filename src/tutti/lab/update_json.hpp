// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::lab {

/// Kind of the event that to_json() makes.
inline constexpr const char* kUpdateScored = "update_scored";

/// An event of a robot program: what the robot made of one proxy graph, and how far the result is from the reference.
program::Json to_json(const mission::UpdateRecord& update);
/// Reads what to_json() of an update wrote; fails when a field has another type.
Result<mission::UpdateRecord> update_of(const program::Json& event);

}  // namespace tutti::lab
