// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Limits on settings of simulated missions. They are far beyond any mission, and keep everything finite, small enough
/// to be computed, and exact to the nanosecond.
namespace tutti::simulation {

inline constexpr double kLongest_s = 7.0 * 86400.0;
inline constexpr double kFarthest_m = 1e6;       ///< Limit on distances, moves and errors.
inline constexpr double kLargestRoom_m = 100.0;  ///< Limit on widths and heights of corridors.

}  // namespace tutti::simulation
