// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "tutti/evaluation/association.hpp"

namespace tutti::evaluation {

/// By how much of an interval its end may be late: beyond it there is a gap.
inline constexpr double kMaxOvershoot = 0.5;

/// Relative pose error (Sturm et al., IROS 2012, eqs. 1, 2): with Q the reference and P the estimate,
///   E_i = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j),
/// rmse over all i of |translation of E_i| and of its rotation angle. Needs no alignment. From every pair i, j is the
/// first pair at least the asked interval later (times to the nanosecond, ways to 1e-9 of it); where that overshoots by
/// more than kMaxOvershoot, i is left out. An error per interval, not divided by it.
struct RpeResult {
  std::size_t count = 0;
  double rmse_m = 0.0;
  double rmse_deg = 0.0;
};

/// Pairs of one robot with increasing stamps; delta > 0. Nothing when no two pairs are that far apart.
std::optional<RpeResult> rpe_over_time(std::span<const PosePair> pairs, double delta_s = 1.0);
/// The interval is the way travelled, summed over the reference's poses.
std::optional<RpeResult> rpe_over_distance(std::span<const PosePair> pairs, double delta_m = 10.0);

}  // namespace tutti::evaluation
