// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "tutti/evaluation/association.hpp"

namespace tutti::evaluation {

/// The end of an interval may be late by this share of it; if it is later there is a gap, and the interval is left out.
inline constexpr double kMaxOvershoot = 0.5;

/// Relative pose error (Sturm et al., IROS 2012, eqs. 1, 2): with Q the reference and P the estimate,
///   E_i = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j),
/// rmse over all i of |translation of E_i| and of its rotation angle. Needs no alignment. For every pair i, j is the
/// first pair at least one interval later (times to the nanosecond, distances to 1e-9 of the interval); where j is late
/// by more than kMaxOvershoot, i is left out. The errors are per interval, not divided by its length.
struct RpeResult {
  std::size_t count = 0;  ///< Intervals that were measured.
  double rmse_m = 0.0;
  double rmse_deg = 0.0;
};

/// `pairs`: of one robot, by increasing stamps; the interval is positive. No value when no two pairs are one interval
/// apart.
std::optional<RpeResult> rpe_over_time(std::span<const PosePair> pairs, double delta_s = 1.0);
/// As rpe_over_time(), with intervals of the distance travelled, summed over the reference's poses.
std::optional<RpeResult> rpe_over_distance(std::span<const PosePair> pairs, double delta_m = 10.0);

}  // namespace tutti::evaluation
