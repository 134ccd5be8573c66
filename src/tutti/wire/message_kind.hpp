// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::wire {

/// What a frame carries. The numbers are on the wire: never reuse one. A cloud alone is not sent, but kept in files.
enum class MessageKind : std::uint8_t { submap = 1, proxy_graph = 2, verdict = 3, cloud = 4 };

/// In words: "submap", "proxy graph", "verdict", "cloud".
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
