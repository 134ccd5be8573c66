// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Rigid T_a_b (no scale) that minimises sum ||p_a - T_a_b p_b||^2 over the pairs of points of equal index (Umeyama,
/// PAMI 1991, eq. 40), m. Both spans have one size. Fewer than 3 points, or points on a line, leave part of the
/// rotation open: the smallest rotation that fits is taken. No points give the identity.
Pose3 align_points(std::span<const Eigen::Vector3d> points_a, std::span<const Eigen::Vector3d> points_b);

}  // namespace tutti
