// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <functional>

namespace tutti {

/// Nanoseconds since the Unix epoch, signed, so that differences never wrap. Subtract first, convert to seconds after:
/// a double holds an epoch in nanoseconds only to about 256 ns.
struct Timestamp {
  std::int64_t ns = 0;
  friend auto operator<=>(const Timestamp&, const Timestamp&) = default;
};

/// Seconds from b to a.
inline double operator-(Timestamp a, Timestamp b) { return static_cast<double>(a.ns - b.ns) * 1e-9; }
inline Timestamp operator+(Timestamp a, double seconds) { return {a.ns + std::llround(seconds * 1e9)}; }
inline Timestamp operator-(Timestamp a, double seconds) { return {a.ns - std::llround(seconds * 1e9)}; }

}  // namespace tutti

template <>
struct std::hash<tutti::Timestamp> {
  std::size_t operator()(const tutti::Timestamp& t) const noexcept { return std::hash<std::int64_t>{}(t.ns); }
};
