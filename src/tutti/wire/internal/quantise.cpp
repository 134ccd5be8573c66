// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/quantise.hpp"

#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"

namespace tutti::wire {
namespace {

using Vector3i64 = Eigen::Matrix<std::int64_t, 3, 1>;

// Beyond this the logarithm of a rotation may come back with the other sign.
constexpr double kMaxRotation_rad = std::numbers::pi - 1e-9;

constexpr double kMinVariance = 1e-24;  // below, there is none
constexpr double kMinPivot = 1e-13;
constexpr double kMaxPivot = 1e12;
constexpr double kMinPivotShare = 1e-6;  // of the variance, that the coordinates before leave
constexpr double kMaxRowEntry = 2e3;     // 1 / sqrt(kMinPivotShare), with room for rounding

std::int64_t round_to(double value, double step) { return std::llround(value / step); }

std::int64_t first_diagonal(double step) { return round_to(std::log(kMinPivot), step) - 1; }

/// Lower Cholesky factor of a positive semidefinite matrix; rows without variance are zero, pivots are kept off zero
/// (and clear of the limit, so that a raised one is not raised again after rounding).
Matrix6d cholesky(const Matrix6d& covariance) {
  Matrix6d G = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double variance = covariance(i, i);
    if (!(variance >= kMinVariance)) continue;
    for (int j = 0; j < i; ++j)
      if (G(j, j) > 0.0) G(i, j) = (covariance(i, j) - G.row(i).head(j).dot(G.row(j).head(j))) / G(j, j);
    const double rest = variance - G.row(i).head(i).squaredNorm();
    const double limit = std::max(kMinPivotShare * variance, kMinVariance);
    G(i, i) = std::sqrt(rest < limit ? 2.0 * limit : rest);
  }
  return G;
}

}  // namespace

PoseCode quantise(const Pose3& T, const PoseSteps& steps) {
  PoseCode code{};
  for (int i = 0; i < 3; ++i) code[i] = round_to(T.translation(i), steps.translation_m);
  const Eigen::Vector3d theta = so3_log(T.rotation);
  Vector3i64 r;
  for (int i = 0; i < 3; ++i) r(i) = round_to(theta(i), steps.rotation_rad);
  while (r.cast<double>().norm() * steps.rotation_rad > kMaxRotation_rad) {
    int largest = 0;
    r.cwiseAbs().maxCoeff(&largest);
    r(largest) -= r(largest) > 0 ? 1 : -1;
  }
  for (int i = 0; i < 3; ++i) code[3 + i] = r(i);
  return code;
}

std::optional<Pose3> dequantise(const PoseCode& code, const PoseSteps& steps) {
  Eigen::Vector3d translation, theta;
  for (int i = 0; i < 3; ++i) {
    translation(i) = static_cast<double>(code[i]) * steps.translation_m;
    theta(i) = static_cast<double>(code[3 + i]) * steps.rotation_rad;
  }
  if (translation.cwiseAbs().maxCoeff() > steps.largest_m || theta.norm() > kMaxRotation_rad) return std::nullopt;
  return Pose3{so3_exp(theta).normalized(), translation};
}

/// Rounds G to G' = G (I + E), E lower triangular, row by row: each entry also takes up what the rounding of the
/// entries above it has done to its row, so |E_ij| <= step / 2 however ill-conditioned G is.
CovarianceCode quantise(const Matrix6d& covariance, const CovarianceSteps& steps) {
  const Matrix6d G = cholesky(covariance);
  Matrix6d E = Matrix6d::Zero();
  CovarianceCode code{};
  std::size_t lower = 6;
  for (int i = 0; i < 6; ++i) {
    const bool has_variance = G(i, i) > 0.0;
    const std::int64_t diagonal = has_variance ? round_to(std::log(G(i, i)), steps.log_diagonal) : 0;
    const double pivot = std::exp(static_cast<double>(diagonal) * steps.log_diagonal);
    code[static_cast<std::size_t>(i)] = has_variance ? diagonal - first_diagonal(steps.log_diagonal) : 0;
    for (int j = 0; j < i; ++j, ++lower) {
      if (!has_variance || G(j, j) <= 0.0) continue;
      const double wanted = G(i, j) + G.row(i).segment(j, i - j).dot(E.col(j).segment(j, i - j));
      code[lower] = round_to(wanted / pivot, steps.lower);
      E(i, j) = (static_cast<double>(code[lower]) * steps.lower * pivot - wanted) / G(i, i);
    }
    if (has_variance) E(i, i) = pivot / G(i, i) - 1.0;
  }
  return code;
}

std::optional<Matrix6d> dequantise(const CovarianceCode& code, const CovarianceSteps& steps) {
  Matrix6d G = Matrix6d::Zero();
  const std::int64_t last_diagonal =
      round_to(std::log(kMaxPivot), steps.log_diagonal) - first_diagonal(steps.log_diagonal);
  std::size_t lower = 6;
  for (int i = 0; i < 6; ++i) {
    const std::int64_t diagonal = code[static_cast<std::size_t>(i)];
    if (diagonal < 0 || diagonal > last_diagonal) return std::nullopt;
    if (diagonal > 0)
      G(i, i) = std::exp(static_cast<double>(diagonal + first_diagonal(steps.log_diagonal)) * steps.log_diagonal);
    for (int j = 0; j < i; ++j, ++lower) {
      const double entry = static_cast<double>(code[lower]) * steps.lower;
      if (std::abs(entry) > kMaxRowEntry) return std::nullopt;
      if (entry != 0.0 && (G(i, i) == 0.0 || G(j, j) == 0.0)) return std::nullopt;
      G(i, j) = entry * G(i, i);
    }
  }
  const Matrix6d covariance = G * G.transpose();
  return Matrix6d(0.5 * (covariance + covariance.transpose()));
}

}  // namespace tutti::wire
