// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/robot/agent.hpp"

namespace tutti::wire {

/// What is wrong with a state that an agent is to go on from; null: nothing.
const char* what_is_wrong(const robot::AgentState& state);

}  // namespace tutti::wire
