// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/robot/agent.hpp"

namespace tutti::wire {

/// Of what an agent relies on in the state that it goes on from. Null: nothing.
const char* what_is_wrong(const robot::AgentState& state);

}  // namespace tutti::wire
