// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

namespace tutti {

/// Of nothing.
inline constexpr std::uint64_t kEmptyHash = 0xcbf29ce484222325ULL;

/// One more byte, or number, of what is hashed.
constexpr std::uint64_t hashed_on(std::uint64_t hash, std::uint64_t next) { return (hash ^ next) * 0x100000001b3ULL; }

/// Tells contents of one name apart: FNV-1a, 64 bits, the same on every machine. Not against whoever knows the content
/// and makes another one with the same hash. `before`: of what stands in front of these bytes.
constexpr std::uint64_t content_hash(std::string_view bytes, std::uint64_t before = kEmptyHash) {
  for (const char c : bytes) before = hashed_on(before, static_cast<unsigned char>(c));
  return before;
}

}  // namespace tutti
