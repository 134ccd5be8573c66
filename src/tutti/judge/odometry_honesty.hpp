// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>

#include "tutti/base/ids.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::judge {

/// What a robot's odometry is worth, as factors on its variances: the least with which a share of its loops
/// (odometry_loops.hpp), of those that tell of odometry more than of closures, miss by no more than chi-square allows
/// that share. 1 with fewer than 8 such loops. Loops that go over the same odometry say the same, so a factor below 1
/// is the largest with which so small misses still have a chance of 10 %, of as many loops as share no odometry.
struct OdometryHonesty {
  /// On the variances of rotations, in [0.04, 1]: 70 % of the loops. Closures need not be judged: fewer than 30 % wrong
  /// ones make it larger, on the safe side; with more it is 1. Rotations only: by how far a loop misses in rotation is
  /// read off directly, and errors of rotation add up like a random walk; how odometry errs in translation depends on
  /// the length of the way.
  double rotation = 1.0;
  /// On all variances, in [0.04, 400]: half of the loops. Of closures that have been judged; below 1 their own
  /// covariance is scaled likewise, so that closures that overstate theirs do not make odometry too sure.
  double whole = 1.0;
};

/// Of every robot of `chains`.
std::map<ChainId, OdometryHonesty> odometry_honesty(std::span<const OdometryChain> chains,
                                                    std::span<const LoopClosure> closures);

/// S C S, S = diag(1, 1, 1, s, s, s), s = sqrt(factor): a covariance (right tangent) with the variances of its
/// rotations times `factor`. To its inverse, information, 1 / factor does the same.
Matrix6d scale_rotation(const Matrix6d& covariance, double factor);

}  // namespace tutti::judge
