// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Rigid T_a_b (no scale) that minimises sum ||p_a - T_a_b p_b||^2 (Umeyama 1991). Sizes must agree; with fewer than 3
/// points, or collinear ones, the undetermined part of the rotation is the smallest one. Empty input gives identity.
Pose3 align_points(std::span<const Eigen::Vector3d> points_a, std::span<const Eigen::Vector3d> points_b);

}  // namespace tutti
