// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "tutti/base/random.hpp"
#include "tutti/estimation/internal/cholesky_factor.hpp"

namespace tutti::estimation::internal {

/// L^-T Z for a Z of independent numbers of zero mean and unit variance, nearly normal: `count` columns of zero mean
/// and covariance (L L^T)^-1. Only the rows of the asked block variables (6 each; < 0: anchored, zero) are returned,
/// and only what they depend on is solved for. The samples of a variable do not depend on which others are asked for.
Eigen::MatrixXd posterior_samples(const CholeskyFactor& factor, std::span<const int> variables, std::size_t count,
                                  Rng rng);

/// The rows and columns of (L L^T)^-1 that belong to these block variables (6 each; < 0: anchored, zero), exactly: Y^T
/// Y with Y = L^-1 E, every column of which is zero but on the path from its variable to the root of the elimination
/// tree.
Eigen::MatrixXd posterior_covariance(const CholeskyFactor& factor, std::span<const int> variables);

}  // namespace tutti::estimation::internal
