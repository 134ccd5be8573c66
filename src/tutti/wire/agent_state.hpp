// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::wire {

/// A robot's whole state as one frame (frame.hpp) and back, every number to the bit: an agent that goes on from what
/// was decoded does as the one that was encoded. Larger ones than kMaxStateBytes cannot be encoded (std::logic_error).
std::string encode(const robot::AgentState& state);
/// Of any bytes: an error, or a state that an agent can go on from.
Result<robot::AgentState> decode_agent_state(std::string_view bytes);

}  // namespace tutti::wire
