// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/robot/agent.hpp"

namespace tutti::wire {

/// Why an agent cannot go on from a state; null: it can.
const char* what_is_wrong(const robot::AgentState& state);

}  // namespace tutti::wire
