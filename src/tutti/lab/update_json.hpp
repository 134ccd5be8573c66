// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::lab {

inline constexpr const char* kUpdateScored = "update_scored";

/// An event of a robot program: what it made of one proxy graph, and how far that is from the reference.
program::Json to_json(const mission::UpdateRecord& update);
/// Of program::to_json(); throws what the JSON library throws.
consistency::SuspectedOrigin origin_of(const program::Json& json);
/// Of such an event.
Result<mission::UpdateRecord> update_of(const program::Json& event);

}  // namespace tutti::lab
