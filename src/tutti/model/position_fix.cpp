// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/position_fix.hpp"

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti {
namespace {

/// The error by rounding, as a share of the largest variance.
constexpr double kRounding = 1e-5;

}  // namespace

Eigen::Matrix3d unknown_fix_covariance() {
  return Eigen::Vector3d(kUnknownFix_m * kUnknownFix_m, kUnknownFix_m * kUnknownFix_m,
                         kUnknownFixUp_m * kUnknownFixUp_m)
      .asDiagonal();
}

Status check_fix(const Geodetic& antenna, const Eigen::Matrix3d& covariance, const Eigen::Vector3d& p_antenna) {
  if (auto ok = check_geodetic(antenna); !ok) return ok;
  constexpr double kLeast = kLeastFixSigma_m * kLeastFixSigma_m, kMost = kLargestFixSigma_m * kLargestFixSigma_m;
  for (int axis = 0; axis < 3; ++axis)
    if (const double variance = covariance(axis, axis); !(variance >= kLeast && variance <= kMost))
      return fail(ErrorCode::invalid, "variance {:g} m^2 {}, expected {:g} to {:g}", variance,
                  axis == 0   ? "east"
                  : axis == 1 ? "north"
                              : "up",
                  kLeast, kMost);
  const double largest = covariance.diagonal().maxCoeff();
  const double least = covariance.allFinite() && (covariance - covariance.transpose()).norm() <= kRounding * largest
                           ? eigen_of(covariance).values(0)
                           : -largest;
  if (!(least >= -kRounding * largest))
    return fail(ErrorCode::invalid,
                "covariance [{:g} {:g} {:g}; {:g} {:g} {:g}; {:g} {:g} {:g}] m^2, expected a symmetric and positive "
                "semidefinite one",
                covariance(0, 0), covariance(0, 1), covariance(0, 2), covariance(1, 0), covariance(1, 1),
                covariance(1, 2), covariance(2, 0), covariance(2, 1), covariance(2, 2));
  if (!(p_antenna.norm() <= kFarthestAntenna_m))
    return fail(ErrorCode::invalid, "antenna {} m from the body, expected at most {} m", p_antenna.norm(),
                kFarthestAntenna_m);
  return {};
}

Eigen::Matrix3d invertible_fix_covariance(const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d raised = covariance;
  raised.diagonal() = raised.diagonal().cwiseMax(kLeastTranslation_m * kLeastTranslation_m);
  const Eigen::Vector3d sigma = raised.diagonal().cwiseSqrt();
  const Eigen::Matrix3d correlation = sigma.cwiseInverse().asDiagonal() * raised * sigma.cwiseInverse().asDiagonal();
  const auto [values, vectors] = eigen_of(correlation);
  if (values(0) >= kRounding) return raised;
  const Eigen::Matrix3d regular = vectors * values.cwiseMax(kRounding).asDiagonal() * vectors.transpose();
  const Eigen::Matrix3d scaled = sigma.asDiagonal() * regular * sigma.asDiagonal();
  return 0.5 * (scaled + scaled.transpose());
}

}  // namespace tutti
