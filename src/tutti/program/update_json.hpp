// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::program {

inline constexpr const char* kUpdateScored = "update_scored";
inline constexpr const char* kEnded = "ended";

/// An event of a robot program: what it made of one proxy graph, and how far that is from the reference.
Json to_json(const mission::UpdateRecord& update);
/// Of such an event.
Result<mission::UpdateRecord> update_of(const Json& event);

}  // namespace tutti::program
