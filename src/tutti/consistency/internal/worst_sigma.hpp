// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace tutti::consistency::internal {

/// Standard deviation in the worst direction, from the sum of x x^T over so many samples of zero mean. The largest
/// eigenvalue of few samples' covariance S is too large when the true ones are alike, so S is first drawn towards
/// tr(S) / 3 I as far as the samples ask for (oracle approximating shrinkage: Chen, Wiesel, Eldar, Hero, "Shrinkage
/// algorithms for MMSE covariance estimation", 2010, eq. 23).
double worst_sigma(const Eigen::Matrix3d& scatter, double samples);

}  // namespace tutti::consistency::internal
