// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>
#include <utility>

#include "tutti/base/ids.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::judge {

/// Factors on the variances of closures, at least 1.
struct ClosureHonesty {
  double translation = 1.0;
  double rotation = 1.0;
  friend bool operator==(const ClosureHonesty&, const ClosureHonesty&) = default;
};

/// By how much the closures between each two chains (the smaller first; or of one with itself) err more than they say.
/// Every closure is held against its neighbour (neighbouring_closures(), odometry_loops.hpp): the least factors on both
/// with which a quarter of the pairs miss by no more than chi-square allows a quarter, first the rotations, then the
/// whole. A quarter, so that up to half of the pairs may hold a wrong closure. Nothing is changed (factor 1) with fewer
/// than 8 pairs, or where both factors are below 2, as chance makes them.
std::map<std::pair<ChainId, ChainId>, ClosureHonesty> closure_honesty(std::span<const OdometryChain> chains,
                                                                      std::span<const LoopClosure> closures);

/// S C S, S = diag(sqrt(translation) three times, sqrt(rotation) three times): right tangent.
Matrix6d scaled(const Matrix6d& covariance, const ClosureHonesty& by);

}  // namespace tutti::judge
