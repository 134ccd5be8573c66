// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::formats::internal {

/// A covariance as files with a fixed number of decimals mean it: the nearest positive semidefinite matrix, in which
/// negative eigenvalues are 0; a positive semidefinite one comes back unchanged.
struct Semidefinite {
  Matrix6d covariance;
  bool is_replaced = false;
};
/// Fails when no eigenvalue is positive, unless all are 0, or when one is not finite.
Result<Semidefinite> nearest_semidefinite(const Matrix6d& covariance);

}  // namespace tutti::formats::internal
