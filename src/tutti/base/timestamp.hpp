// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>

namespace tutti {

/// Nanoseconds since the Unix epoch, signed, so that differences never wrap. Subtract first, convert to seconds after:
/// a double has a time since the epoch only to about 256 ns.
struct Timestamp {
  std::int64_t ns = 0;
  friend auto operator<=>(const Timestamp&, const Timestamp&) = default;
};

inline constexpr Timestamp kFirstTimestamp{std::numeric_limits<std::int64_t>::min()};
inline constexpr Timestamp kLastTimestamp{std::numeric_limits<std::int64_t>::max()};

/// Seconds to the nearest nanosecond. Durations that 64 bits do not hold (beyond 292 years) become the longest that
/// they hold. NaN is not allowed.
inline std::int64_t to_nanoseconds(double seconds) {
  constexpr double kTooMany = 0x1p63;
  const double ns = seconds * 1e9;
  if (ns >= kTooMany) return kLastTimestamp.ns;
  return ns < -kTooMany ? kFirstTimestamp.ns : std::llround(ns);
}

/// Seconds from b to a.
inline double operator-(Timestamp a, Timestamp b) {
  std::int64_t ns = 0;
  const bool wraps = __builtin_sub_overflow(a.ns, b.ns, &ns);
  return (wraps ? static_cast<double>(a.ns) - static_cast<double>(b.ns) : static_cast<double>(ns)) * 1e-9;
}
/// Saturates at the first and the last timestamp; a step of more than 292 years leads there from anywhere.
inline Timestamp operator+(Timestamp a, double seconds) {
  const Timestamp step{to_nanoseconds(seconds)};
  if (step == kFirstTimestamp || step == kLastTimestamp) return step;
  Timestamp sum;
  if (__builtin_add_overflow(a.ns, step.ns, &sum.ns)) return step.ns > 0 ? kLastTimestamp : kFirstTimestamp;
  return sum;
}
inline Timestamp operator-(Timestamp a, double seconds) { return a + -seconds; }

/// Median of the differences between consecutive stamps, s; of an even number of them the larger middle one. 0 for
/// fewer than two stamps.
double typical_gap_s(std::span<const Timestamp> stamps);

}  // namespace tutti

template <>
struct std::hash<tutti::Timestamp> {
  std::size_t operator()(const tutti::Timestamp& t) const noexcept { return std::hash<std::int64_t>{}(t.ns); }
};
