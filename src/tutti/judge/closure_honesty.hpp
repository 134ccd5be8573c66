// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>
#include <utility>

#include "tutti/base/ids.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::judge {

/// Factors, at least 1, on the variances that closures state.
struct ClosureHonesty {
  double translation = 1.0;
  double rotation = 1.0;
  friend bool operator==(const ClosureHonesty&, const ClosureHonesty&) = default;
};

/// By how much the closures between two chains (the smaller first; or of one chain with itself) err more than they
/// state. Every closure is compared with its neighbour (neighbouring_closures(), odometry_loops.hpp). The factors are
/// the least with which a quarter of the pairs miss by no more than chi-square allows a quarter, first of rotation
/// alone, then of translation for the whole. A quarter, so that half of the pairs may contain a wrong closure. A factor
/// that would exceed 400 is 1, because too many closures are wrong to judge by. So is one that chance makes somewhere
/// in a map of so many chains. Chains with fewer than 8 pairs, or with both factors below 2, have no entry.
/// docs/math.md, "Outlier rejection".
std::map<std::pair<ChainId, ChainId>, ClosureHonesty> closure_honesty(std::span<const OdometrySegment> segments,
                                                                      std::span<const LoopClosure> closures);

/// A closure's covariance C (right tangent) with the factors applied: S C S, S = diag(sqrt(translation) three times,
/// sqrt(rotation) three times).
Matrix6d scaled(const Matrix6d& covariance, const ClosureHonesty& by);

}  // namespace tutti::judge
