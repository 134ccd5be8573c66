// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/covariance.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace tutti {
namespace {

constexpr double kPsdTolerance = 1e-9;  // of the trace
/// A correlation matrix's: with less, the inverse is rounding.
constexpr double kLeastPivot = 1e-9;

Vector6d per_axis(double translation, double rotation) {
  Vector6d out;
  out << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  return out;
}

/// Scaled to a unit diagonal, so that metres and radians are judged alike; 0 where there is no variance.
Matrix6d correlation_of(const Matrix6d& covariance) {
  const Vector6d scale =
      covariance.diagonal().unaryExpr([](double variance) { return variance > 0.0 ? 1.0 / std::sqrt(variance) : 0.0; });
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace

Status check_covariance(const Matrix6d& covariance) {
  if (!covariance.allFinite()) return fail(ErrorCode::invalid, "covariance is not finite");
  const double largest = covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kPsdTolerance * largest)
    return fail(ErrorCode::invalid, "covariance is not symmetric");
  if (covariance.diagonal().minCoeff() < 0.0)
    return fail(ErrorCode::invalid, "negative variance ({})", covariance.diagonal().minCoeff());
  for (int i = 0; i < 6; ++i)
    if (covariance(i, i) == 0.0 && covariance.row(i).cwiseAbs().maxCoeff() > 0.0)
      return fail(ErrorCode::invalid, "covariance row {} has no variance but correlations", i);
  Matrix6d correlation = correlation_of(covariance);
  correlation.diagonal().setConstant(1.0 + 6.0 * kPsdTolerance);
  if (correlation.llt().info() != Eigen::Success)
    return fail(ErrorCode::invalid, "covariance is not positive semidefinite");
  return {};
}

Matrix6d diagonal_covariance(double sigma_m, double sigma_rad) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(sigma_m * sigma_m), Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  return variances.asDiagonal();
}

Matrix6d bounded_covariance(const Matrix6d& covariance, double most_m, double most_rad) {
  const Vector6d most = per_axis(most_m, most_rad).cwiseAbs2();
  if ((covariance.diagonal().array() <= most.array()).all()) return covariance;
  const Vector6d scale = (most.array() / covariance.diagonal().array().max(most.array())).sqrt();
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

Matrix6d invertible_covariance(const Matrix6d& covariance) {
  const Vector6d least = per_axis(kLeastTranslation_m, kLeastRotation_rad).cwiseAbs2();
  if ((covariance.diagonal().array() >= least.array()).all()) {
    const Eigen::LLT<Matrix6d> factor = correlation_of(covariance).llt();
    if (factor.info() == Eigen::Success && factor.matrixLLT().diagonal().cwiseAbs2().minCoeff() > kLeastPivot)
      return covariance;
  }
  return covariance + Matrix6d(least.asDiagonal());
}

}  // namespace tutti
