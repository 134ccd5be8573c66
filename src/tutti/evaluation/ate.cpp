// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/ate.hpp"

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

}  // namespace tutti::evaluation
