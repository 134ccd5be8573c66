// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/robot/agent.hpp"

/// A robot's own state and what it has heard, to the bit.
namespace tutti::wire {

/// A robot's whole state as one frame (frame.hpp) and back, every number to the bit: an agent that goes on from what
/// was decoded does as the one that was encoded. Larger ones than kMaxStateBytes cannot be encoded (std::logic_error).
std::string encode(const robot::AgentState& state);
/// Of any bytes: an error, or a state that an agent can go on from.
Result<robot::AgentState> decode_agent_state(std::string_view bytes);
/// Exact, as they are in the state; what is in them is checked by who hears them.
std::string encode(const TrackedImages& images);
Result<TrackedImages> decode_tracked_images(std::string_view bytes);

}  // namespace tutti::wire
