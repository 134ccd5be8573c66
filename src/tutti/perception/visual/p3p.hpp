// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::visual {

/// The poses (at most four) from which three points of a map, m, are seen in three unit directions of a camera, with
/// the points in front: the angles between the directions give the distances, which solve two quadratic forms at once;
/// a degenerate member of their pencil is a pair of planes (Persson and Nordberg, "Lambda Twist", ECCV 2018). Empty for
/// points on a line. Returns T_camera_map.
std::vector<Pose3> p3p(const std::array<Eigen::Vector3d, 3>& directions_camera,
                       const std::array<Eigen::Vector3d, 3>& points_map);

}  // namespace tutti::visual
