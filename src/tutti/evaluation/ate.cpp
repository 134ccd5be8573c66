// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/ate.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/geometry/alignment.hpp"

namespace tutti::evaluation {

std::optional<AteResult> ate(std::span<const PosePair> pairs) {
  std::vector<Eigen::Vector3d> reference;
  std::vector<Eigen::Vector3d> estimate;
  for (const PosePair& pair : pairs) {
    reference.push_back(pair.reference.translation);
    estimate.push_back(pair.estimate.translation);
  }
  return ate_aligned(pairs, align_points(reference, estimate));
}

std::optional<AteResult> ate_aligned(std::span<const PosePair> pairs, const Pose3& T_reference_estimate) {
  if (pairs.empty()) return std::nullopt;
  std::vector<double> errors_m;
  double sum_m = 0.0;
  double sum_m2 = 0.0;
  double sum_rad2 = 0.0;
  for (const PosePair& pair : pairs) {
    const Pose3 error = pair.reference.inverse() * T_reference_estimate * pair.estimate;  // F_i, eq. 4
    errors_m.push_back(error.translation.norm());
    sum_m += errors_m.back();
    sum_m2 += error.translation.squaredNorm();
    sum_rad2 += std::pow(rotation_angle(error), 2);
  }
  const auto n = static_cast<double>(pairs.size());
  std::sort(errors_m.begin(), errors_m.end());
  const double median_m = 0.5 * (errors_m[(errors_m.size() - 1) / 2] + errors_m[errors_m.size() / 2]);
  return AteResult{.pairs = pairs.size(),
                   .rmse_m = std::sqrt(sum_m2 / n),  // eq. 5
                   .mean_m = sum_m / n,
                   .median_m = median_m,
                   .max_m = errors_m.back(),
                   .rmse_deg = std::sqrt(sum_rad2 / n) * 180.0 / std::numbers::pi,
                   .T_reference_estimate = T_reference_estimate};
}

double best_scale(std::span<const PosePair> pairs) {
  Eigen::Vector3d reference_mean = Eigen::Vector3d::Zero(), estimate_mean = reference_mean;
  for (const PosePair& pair : pairs) {
    reference_mean += pair.reference.translation / static_cast<double>(pairs.size());
    estimate_mean += pair.estimate.translation / static_cast<double>(pairs.size());
  }
  Eigen::Matrix3d together = Eigen::Matrix3d::Zero();
  double spread_m2 = 0.0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d estimate = pair.estimate.translation - estimate_mean;
    together += (pair.reference.translation - reference_mean) * estimate.transpose();
    spread_m2 += estimate.squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(together);
  Eigen::Vector3d D = svd.singularValues();
  if (together.determinant() < 0.0) D.z() = -D.z();
  return spread_m2 > 0.0 && D.sum() > 0.0 ? D.sum() / spread_m2 : 1.0;
}

std::vector<PosePair> scaled(std::span<const PosePair> pairs, double scale) {
  std::vector<PosePair> out(pairs.begin(), pairs.end());
  for (PosePair& pair : out) pair.estimate.translation *= scale;
  return out;
}

}  // namespace tutti::evaluation
