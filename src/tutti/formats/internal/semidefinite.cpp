// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/semidefinite.hpp"

#include "tutti/geometry/symmetric.hpp"

namespace tutti::formats::internal {

Result<Semidefinite> nearest_semidefinite(const Matrix6d& covariance) {
  constexpr double kNoEigenvalue = 1e-12;  // this far below zero, as a share of the largest, is zero
  const auto [values, vectors] = eigen_of(covariance);
  const double least = values(0), most = values(5);
  if (least >= -kNoEigenvalue * most) return Semidefinite{covariance, false};
  if (!(most > 0.0) || !values.allFinite())
    return fail(ErrorCode::invalid, "eigenvalues of the covariance are {:.3g} to {:.3g}, expected a positive one",
                least, most);
  const Matrix6d nearest = vectors * values.cwiseMax(0.0).asDiagonal() * vectors.transpose();
  return Semidefinite{0.5 * (nearest + nearest.transpose()), true};
}

}  // namespace tutti::formats::internal
