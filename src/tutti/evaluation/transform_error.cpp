// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/transform_error.hpp"

#include <numbers>

namespace tutti::evaluation {

TransformError transform_error(const Pose3& T_a_b, const Pose3& T_a_b_reference, const Eigen::Vector3d& point_b) {
  return {.translation_m = (T_a_b * point_b - T_a_b_reference * point_b).norm(),
          .rotation_deg = rotation_angle(T_a_b_reference.inverse() * T_a_b) * 180.0 / std::numbers::pi};
}

std::optional<Eigen::Vector3d> centroid(const Trajectory& trajectory) {
  if (trajectory.empty()) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : trajectory) sum += pose.pose.translation;
  return sum / static_cast<double>(trajectory.size());
}

}  // namespace tutti::evaluation
