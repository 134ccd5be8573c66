// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>

#include "tutti/base/ids.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::judge {

/// The honesty of a chain's odometry, as factors on the variances that it states. Each is the least factor with which a
/// given share of the chain's loops (odometry_loops.hpp) miss by no more than chi-square allows that share; only loops
/// count in which odometry's covariance exceeds the closures'. 1 with fewer than 8 such loops. Loops over the same
/// odometry repeat each other, so a factor below 1 is raised to where misses this small still have a chance of 10 % for
/// as many loops as share no odometry.
struct OdometryHonesty {
  /// On the variances of rotation, in [0.04, 1], from 70 % of the loops. Closures need not be judged before: fewer than
  /// 30 % wrong ones make the factor larger, on the safe side; more make it 1. Translation has no such factor: errors
  /// of rotation add up like a random walk, while errors of translation depend on the distance travelled.
  double rotation = 1.0;
  /// On all variances, in [0.04, 400], from half of the loops. Closures must have been judged before. Below 1 the
  /// closures' covariance is scaled, too, so that closures that overstate theirs do not make odometry too certain.
  double whole = 1.0;
};

/// One entry per chain in `segments`. `closures` join keyframes of these chains.
std::map<ChainId, OdometryHonesty> odometry_honesty(std::span<const OdometrySegment> segments,
                                                    std::span<const LoopClosure> closures);

/// A covariance C (right tangent) with the variances of rotation times `factor`: S C S, S = diag(1, 1, 1, s, s, s), s =
/// sqrt(factor). The same call with 1 / factor does it to an information matrix.
Matrix6d scale_rotation(const Matrix6d& covariance, double factor);

}  // namespace tutti::judge
