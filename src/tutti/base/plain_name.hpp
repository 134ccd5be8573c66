// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace tutti {

/// Letters, digits, '_' and '-': what a subject of the bus, a folder and a unit of systemd can all be called.
inline bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

/// Whether a robot, a mission or a member of a bus can have this name: 1 to `most` of is_plain().
inline bool is_plain_name(std::string_view name, std::size_t most) {
  return !name.empty() && name.size() <= most && std::ranges::all_of(name, is_plain);
}

}  // namespace tutti
