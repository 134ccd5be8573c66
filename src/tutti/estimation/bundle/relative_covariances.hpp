// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

/// Variance of the views in units of what they claim (sigma_px), at the solution: their median squared residual over
/// that of noise of which the landmarks have absorbed their share; 1 where they are as good as they say.
double view_variance(const BundleProblem& problem, const BundleSolution& solution);

/// Covariance of T_from_to (right tangent) between the ends of every odometry factor, in their order: blocks of the
/// inverse of the joint Gauss-Newton Hessian at the solution, landmarks eliminated (Schur complement), computed on the
/// pattern of its sparse Cholesky factor alone. Views weigh as the robust loss left them, and less by view_variance()
/// where that is above 1. Nothing when the problem does not determine every pose.
std::optional<std::vector<Matrix6d>> odometry_posterior(const BundleProblem& problem, const BundleSolution& solution,
                                                        const BundleConfig& config);

}  // namespace tutti::bundle
