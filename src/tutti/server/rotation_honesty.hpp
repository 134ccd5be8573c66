// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>

#include "tutti/base/ids.hpp"
#include "tutti/estimation/odometry_trial.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

/// By how much each robot's odometry overstates the variances of its rotations, as a factor on them in [0.08, 1]: twice
/// (loops share their odometry, so a walk tells of it only so well) the least at which 70 % of the loops that tell of
/// it miss in rotation by no more than the chi-square distribution (3 degrees of freedom) allows for 70 %. The closures
/// are not judged yet: as long as less than 30 % of the loops are wrong, those make the factor larger, on the safe
/// side; with more it is 1. 1 with fewer than 8 loops, too. Rotations only: by how far a loop misses in rotation is
/// read off directly, and errors of rotation add up like a random walk. How odometry errs in translation depends on the
/// length of the way (its scale), and short loops would belittle that.
std::map<ChainId, double> rotation_variance_factors(std::span<const estimation::OdometryChain> chains,
                                                    std::span<const LoopClosure> closures);

/// S C S, S = diag(1, 1, 1, s, s, s), s = sqrt(factor): a covariance (right tangent) with the variances of its
/// rotations times `factor`. To its inverse, information, 1 / factor does the same.
Matrix6d scale_rotation(const Matrix6d& covariance, double factor);

}  // namespace tutti::server
