// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/robot/agent.hpp"

/// A robot's own state and what it has heard, to the bit.
namespace tutti::wire {

/// A robot's whole state as one frame (frame.hpp) and back, every number to the bit: an agent that goes on from what
/// was decoded does as the one that was encoded. Robots stored it so once (version 3), and tests compare by it. Larger
/// ones than kMaxStateBytes cannot be encoded (std::logic_error).
std::string encode(const robot::AgentState& state);
/// Of any bytes: an error, or a state that an agent can go on from.
Result<robot::AgentState> decode_agent_state(std::string_view bytes);
/// A robot's state as it is stored: rows by key, of which those that change do not grow with the way (but for
/// `corrections`, with the links to the map, after a graph was received). The keys:
///   "head"              AgentHead
///   "chain/" FIRST      keyframes from FIRST (8 bytes) on, each with the odometry that leads to it; never changed
///   "link/" FROM TO     a constraint of the ledger
///   "corrections"       what of the smoother follows from nothing else
using StateRows = std::map<std::string, std::string, std::less<>>;

/// What has been stored of an agent, so that what has not changed is not stored again.
struct StoredState {
  std::size_t keyframes = 0;
  std::uint64_t comparisons = 0;  ///< Ledger and smoother were stored after so many.
  bool has_corrections = false;   ///< They were stored at all.
  std::vector<consistency::Constraint> links;
};
struct StateChange {
  StateRows put;
  std::vector<std::string> removed;  ///< Keys.
};
/// What is to be written and deleted so that the rows are those of `agent`, of which `stored` is; that is then of this
/// agent.
StateChange changed_rows(const robot::RobotAgent& agent, StoredState& stored);
/// An error, or a state that an agent can go on from, to the bit. Rows of other keys are left alone.
Result<robot::AgentState> decode_state_rows(const StateRows& rows);
StoredState stored_state(const robot::AgentState& state);

/// Exact, as they are in the state; what is in them is checked by who hears them.
std::string encode(const TrackedImages& images);
Result<TrackedImages> decode_tracked_images(std::string_view bytes);

}  // namespace tutti::wire
