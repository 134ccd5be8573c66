// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::wire {

/// What a frame carries. The numbers are on the wire: never reuse one.
enum class MessageKind : std::uint8_t { submap = 1, proxy_graph = 2, verdict = 3 };

}  // namespace tutti::wire
