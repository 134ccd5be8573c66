// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/spectral/meyer.hpp"

/// Wavelets on the time chain: the path graph 0 - 1 - ... - (n - 1) with unit weights. Its spectrum is known in closed
/// form (Strang 1999, "The discrete cosine transform"): lambda_k = 2 - 2 cos(pi k / n), u_k(m) ~ cos(pi k (m + 1/2) /
/// n), so the graph Fourier transform (eqs. 4, 5 of the paper) is a cosine transform and costs n log n.
namespace tutti::spectral {

inline constexpr double kChainLambdaMax = 4.0;  ///< No path graph's largest eigenvalue reaches it.

/// lambda_k of the path graph of n nodes, k in [0, n).
[[nodiscard]] double chain_eigenvalue(Eigen::Index k, Eigen::Index n);

/// The least length >= n that has no prime factor above 5. The transform of a length with large prime factors costs
/// n^2; a chain may be made longer by nodes that repeat its last value (7 % longer at worst from 1,000 nodes on, 11 %
/// from 50 on), which an even reflection at the end hardly notices.
[[nodiscard]] Eigen::Index fast_chain_length(Eigen::Index n);

/// Coefficients of the signals (columns, n x d), laid out as by exact_transform(): n x (scales * d), column s * d + c.
[[nodiscard]] Eigen::MatrixXd chain_transform(const MeyerFilterBank& bank, const Eigen::MatrixXd& signals);

}  // namespace tutti::spectral
