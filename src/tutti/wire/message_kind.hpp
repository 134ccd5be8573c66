// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::wire {

/// The kind of message in a frame. The numbers are on the wire and in stores: never reuse one. verdict, cloud,
/// agent_state, tracked_images and estimate are stored, never sent.
enum class MessageKind : std::uint8_t {
  submap = 1,
  proxy_graph = 2,
  verdict = 3,
  cloud = 4,
  receipt = 5,   ///< Which submaps of a robot the server has stored or refuses.
  job = 6,       ///< Pairs of submaps to be verified.
  verdicts = 7,  ///< The answer to a job.
  status = 8,    ///< How a robot or a worker is doing.
  agent_state = 9,
  mission_status = 10,
  submap_request = 13,     ///< Which submaps a worker lacks.
  submap_copy = 14,        ///< A submap for a worker that lacks it.
  decision = 15,           ///< An operator's decision on a closure.
  proxy_graph_delta = 17,  ///< A proxy graph in terms of an earlier one.
  tracked_images = 18,     ///< Images of a robot's cameras, in its journal.
  refinement_job = 19,     ///< Submaps to be refined together.
  refinement = 20,         ///< The answer to a refinement job.
  mark = 21,               ///< An operator's note on the map; travels as a `decision` does.
  estimate = 22,           ///< A server's map, for who reads its file meanwhile.
};

/// The kind in words: "submap", "proxy graph", ...
const char* name(MessageKind kind);

/// The versions of a kind that this program reads. Each kind has versions of its own, so that a change of its coding
/// makes no other kind unreadable. Frames are written in the current version.
struct Versions {
  std::uint16_t oldest = 1;
  std::uint16_t current = 1;
  friend bool operator==(const Versions&, const Versions&) = default;
};
Versions versions(MessageKind kind);

}  // namespace tutti::wire
