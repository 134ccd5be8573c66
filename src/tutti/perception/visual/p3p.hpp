// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::visual {

/// The poses T_camera_map, at most four, from which three points (map frame, m) are seen in three unit directions
/// (camera frame), with the points in front. Method: the distances to the points solve two quadratic forms, and a
/// degenerate member of their pencil is a pair of planes (Persson and Nordberg, "Lambda Twist", ECCV 2018). Empty for
/// points on a line.
std::vector<Pose3> p3p(const std::array<Eigen::Vector3d, 3>& directions_camera,
                       const std::array<Eigen::Vector3d, 3>& points_map);

}  // namespace tutti::visual
