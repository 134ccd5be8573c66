// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// Difference of two transforms between the same frames.
struct TransformError {
  double translation_m = 0.0;  ///< Distance between the two images of one point.
  double rotation_deg = 0.0;   ///< Angle between the two rotations.
};

/// How far `T_a_b` is from `T_a_b_reference` at a point of b. Choose the centroid of what was seen in b: at the origin
/// of b, which may be far from it, a small rotation looks like metres.
TransformError transform_error(const Pose3& T_a_b, const Pose3& T_a_b_reference, const Eigen::Vector3d& point_b);

/// Mean position, m; no value for an empty trajectory.
std::optional<Eigen::Vector3d> centroid(const Trajectory& trajectory);

}  // namespace tutti::evaluation
