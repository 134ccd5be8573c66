// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// The most that settings of simulated missions may ask for: far beyond any mission, and everything stays finite, small
/// enough to be computed, and exact to the nanosecond.
namespace tutti::simulation {

inline constexpr double kLongest_s = 7.0 * 86400.0;
inline constexpr double kFarthest_m = 1e6;       ///< Ways, moves and errors.
inline constexpr double kLargestRoom_m = 100.0;  ///< Across a corridor.
inline constexpr double kMostPer100m = 1000.0;

}  // namespace tutti::simulation
