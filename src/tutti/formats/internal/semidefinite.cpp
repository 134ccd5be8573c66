// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/semidefinite.hpp"

#include <Eigen/Eigenvalues>

namespace tutti::formats::internal {

Result<Semidefinite> nearest_semidefinite(const Matrix6d& covariance) {
  constexpr double kNoEigenvalue = 1e-12;  // this far below zero, as a share of the largest, is zero
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(covariance);
  const double least = eigen.eigenvalues()(0), most = eigen.eigenvalues()(5);
  if (least >= -kNoEigenvalue * most) return Semidefinite{covariance, false};
  if (!(most > 0.0) || !eigen.eigenvalues().allFinite())
    return fail(ErrorCode::invalid, "eigenvalues of the covariance are {:.3g} to {:.3g}, expected a positive one",
                least, most);
  const Matrix6d nearest =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose();
  return Semidefinite{0.5 * (nearest + nearest.transpose()), true};
}

}  // namespace tutti::formats::internal
