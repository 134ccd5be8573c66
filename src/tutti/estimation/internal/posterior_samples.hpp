// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "tutti/base/random.hpp"
#include "tutti/estimation/internal/block_cholesky.hpp"

namespace tutti::estimation::internal {

/// L^-T Z for a Z of independent random signs, `count` columns of zero mean and covariance (L L^T)^-1. Only the rows of
/// the asked block variables (6 each; < 0: anchored, zero) are returned, and only what they depend on is solved for.
Eigen::MatrixXd posterior_samples(const BlockCholesky::Columns& factor, std::span<const int> variables,
                                  std::size_t count, Rng rng);

}  // namespace tutti::estimation::internal
