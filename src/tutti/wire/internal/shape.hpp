// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tutti/model/proxy_graph.hpp"

/// The sigmas of a ShapeUncertainty as one byte each.
namespace tutti::wire {

inline constexpr double kSmallestSigma = 1e-6;       ///< m or rad; smaller ones, but for 0, become this.
inline constexpr double kSigmaRatio = 1.1;           ///< Of neighbouring codes: an error of at most 4.9 %.
inline constexpr std::int64_t kLastSigmaCode = 255;  ///< 3.3e4; larger ones become this.

/// 0 is 0; sigma is finite and not negative.
inline std::int64_t quantise_sigma(double sigma) {
  if (sigma <= 0.0) return 0;
  const double code = 1.0 + std::round(std::log(sigma / kSmallestSigma) / std::log(kSigmaRatio));
  return static_cast<std::int64_t>(std::clamp(code, 1.0, static_cast<double>(kLastSigmaCode)));
}

/// Nothing when the code is not one that quantise_sigma() makes.
inline std::optional<double> dequantise_sigma(std::int64_t code) {
  if (code < 0 || code > kLastSigmaCode) return std::nullopt;
  return code == 0 ? 0.0 : kSmallestSigma * std::pow(kSigmaRatio, static_cast<double>(code - 1));
}

}  // namespace tutti::wire
