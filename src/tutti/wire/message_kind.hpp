// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::wire {

/// What a frame carries. The numbers are on the wire: never reuse one. Single verdicts, clouds alone and the states of
/// agents are not sent, but kept.
enum class MessageKind : std::uint8_t {
  submap = 1,
  proxy_graph = 2,
  verdict = 3,
  cloud = 4,
  receipt = 5,   ///< Which submaps of a robot the server has stored.
  job = 6,       ///< Pairs of submaps to be verified.
  verdicts = 7,  ///< The answer to a job.
  status = 8,    ///< Of a robot or a worker.
  agent_state = 9,
  mission_status = 10,
  submap_request = 13,     ///< Which submaps a worker lacks.
  submap_copy = 14,        ///< One of them.
  word = 15,               ///< What an operator says of a closure.
  proxy_graph_delta = 17,  ///< A proxy graph in terms of an earlier one.
  tracked_images = 18,     ///< A robot's own, in its journal.
  refinement_job = 19,     ///< Submaps to be refined together.
  refinement = 20,         ///< The answer to that.
};

/// In words: "submap", "proxy graph", ...
const char* name(MessageKind kind);

/// Each kind has a version of its own, which is raised when its coding changes: a change of one makes nothing of
/// another unreadable. Frames are written in the current version and read from the oldest on.
struct Versions {
  std::uint16_t oldest = 1;
  std::uint16_t current = 1;
  friend bool operator==(const Versions&, const Versions&) = default;
};
Versions versions(MessageKind kind);

}  // namespace tutti::wire
