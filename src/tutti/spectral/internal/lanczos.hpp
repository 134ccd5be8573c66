// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/spectral/internal/row_blocks.hpp"

namespace tutti::spectral::internal {

/// Fixed numbers in [-1, 1) without any pattern, so that no eigenvector is orthogonal to them; zero in the padding.
[[nodiscard]] Eigen::VectorXd start_vector(const RowBlocks& matrix);

/// See spectral::largest_eigenvalue; `bound` is an upper bound on it, 0 for a zero matrix.
[[nodiscard]] double largest_eigenvalue(const RowBlocks& matrix, double bound, double tolerance);

}  // namespace tutti::spectral::internal
