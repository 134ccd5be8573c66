// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::wire {

/// What a frame carries. The numbers are on the wire: never reuse one. A cloud alone is not sent, but kept in files.
enum class MessageKind : std::uint8_t { submap = 1, proxy_graph = 2, verdict = 3, cloud = 4 };

/// In words: "submap", "proxy graph", "verdict", "cloud".
const char* name(MessageKind kind);

}  // namespace tutti::wire
