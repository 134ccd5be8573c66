// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

namespace tutti {

/// The content_hash() of no bytes: FNV's offset basis.
inline constexpr std::uint64_t kEmptyHash = 0xcbf29ce484222325ULL;

/// The hash after one more byte (or 64-bit number): the step of FNV-1a.
constexpr std::uint64_t hashed_on(std::uint64_t hash, std::uint64_t next) { return (hash ^ next) * 0x100000001b3ULL; }

/// Distinguishes two contents of one name: FNV-1a, 64 bits, the same on every machine. It is no protection against
/// somebody who makes another content with the same hash on purpose. `before`: the hash of the bytes in front of these,
/// so that content_hash(b, content_hash(a)) is that of a and b together.
constexpr std::uint64_t content_hash(std::string_view bytes, std::uint64_t before = kEmptyHash) {
  for (const char c : bytes) before = hashed_on(before, static_cast<unsigned char>(c));
  return before;
}

}  // namespace tutti
