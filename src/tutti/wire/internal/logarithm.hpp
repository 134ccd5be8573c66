// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

/// Positive numbers by their logarithm, in so many steps from one to its double.
namespace tutti::wire {

inline constexpr double kSmallestLogged = 1e-9;  ///< Smaller ones, but for 0, become this; larger ones than
inline constexpr double kLargestLogged = 1e9;    ///< this, this.

/// 0 is 0; others, finite and not negative, are rounded up: what is unsure must not become surer in transit.
inline std::int64_t quantise_log(double value, int steps) {
  if (value <= 0.0) return 0;
  const double bounded = std::clamp(value, kSmallestLogged, kLargestLogged);
  return 1 + static_cast<std::int64_t>(std::ceil(steps * std::log2(bounded / kSmallestLogged) - 1e-6));
}

/// Nothing when the code is not one that quantise_log() makes.
inline std::optional<double> dequantise_log(std::int64_t code, int steps) {
  if (code < 0 || code > quantise_log(kLargestLogged, steps)) return std::nullopt;
  return code == 0 ? 0.0 : kSmallestLogged * std::exp2(static_cast<double>(code - 1) / steps);
}

}  // namespace tutti::wire
