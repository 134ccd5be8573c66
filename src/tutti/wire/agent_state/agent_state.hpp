// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/robot/agent.hpp"

/// A robot's own state, and the images in its journal, as bytes and back, exact to the bit. None of it is ever sent.
namespace tutti::wire {

/// A robot's whole state as one frame (frame.hpp). An agent that goes on from the decoded state does the same as the
/// one that was encoded. Robots store rows (below); tests compare states by these bytes. A state above kMaxStateBytes
/// is std::logic_error.
std::string encode(const robot::AgentState& state);
/// Accepts any bytes and returns an error or a state that an agent can go on from.
Result<robot::AgentState> decode_agent_state(std::string_view bytes);
/// A robot's state as it is stored: rows by key. Rows that are written again do not grow with the length of the
/// trajectory; `corrections`, which is written after a proxy graph was received, grows with the number of constraints.
/// The keys:
///   "head"              AgentHead
///   "chain/" FIRST      keyframes from number FIRST (8 bytes) on, each with the odometry that leads to it; never
///   changed "link/" FROM TO     a constraint of the ledger, by its two nodes "corrections"       the part of the
///   smoother's state that does not follow from the other rows
using StateRows = std::map<std::string, std::string, std::less<>>;

/// The stored state of an agent, by which changed_rows() leaves out what has not changed since.
struct StoredState {
  std::size_t keyframes = 0;
  std::uint64_t comparisons = 0;  ///< Number of comparisons with the map after which ledger and smoother were stored.
  bool has_corrections = false;   ///< Whether they have been stored at all.
  std::vector<consistency::Constraint> links;
};
struct StateChange {
  StateRows put;
  std::vector<std::string> removed;  ///< Keys.
};
/// The rows to write and to delete so that the stored rows, described by `stored`, become those of `agent`. `stored` is
/// updated to describe them.
StateChange changed_rows(const robot::RobotAgent& agent, StoredState& stored);
/// The state of these rows, to the bit, which an agent can go on from; or an error. Rows of other keys are ignored.
Result<robot::AgentState> decode_state_rows(const StateRows& rows);
/// The StoredState of an agent after its state was read by decode_state_rows().
StoredState stored_state(const robot::AgentState& state);

/// Images of one time for the journal, exact. Decoding checks that the bytes are complete, not what they mean:
/// check_images() does.
std::string encode(const TrackedImages& images);
Result<TrackedImages> decode_tracked_images(std::string_view bytes);

}  // namespace tutti::wire
