// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// Difference of two transforms between the same frames.
struct TransformError {
  double translation_m = 0.0;  ///< Distance between where the two put one point.
  double rotation_deg = 0.0;   ///< Angle between the two rotations.
};

/// How far `T_a_b` is from `T_a_b_reference` at a point of b. The origin of b may be far from everything that was seen,
/// and a small rotation then looks like metres: measure at the centroid of what lies in b.
TransformError transform_error(const Pose3& T_a_b, const Pose3& T_a_b_reference, const Eigen::Vector3d& point_b);

/// Mean position; nothing for an empty trajectory.
std::optional<Eigen::Vector3d> centroid(const Trajectory& trajectory);

}  // namespace tutti::evaluation
