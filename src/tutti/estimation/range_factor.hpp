// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

/// A measured distance between a point on each of two bodies.
struct Range {
  Eigen::Vector3d p_i = Eigen::Vector3d::Zero();  ///< In the body frame of i, m.
  Eigen::Vector3d p_j = Eigen::Vector3d::Zero();  ///< In the body frame of j, m.
  double distance_m = 0.0;
};

/// r = |T_ij p_j - p_i| - distance, with its derivatives by right perturbations of T_w_i and T_w_j. Where the two
/// points coincide the distance has no derivative, and 0 is returned for it.
struct RangeLinearisation {
  double residual = 0.0;
  Eigen::Matrix<double, 1, 6> J_i;
  Eigen::Matrix<double, 1, 6> J_j;
};
RangeLinearisation linearise_range(const Pose3& T_w_i, const Pose3& T_w_j, const Range& range);

/// The range as an edge of a pose graph, linearised at the graph's poses: its information has rank one, and its cost
/// and gradient there are the range's. It must be made anew when the poses have moved.
PoseGraphEdge range_edge(std::size_t i, std::size_t j, const Pose3& T_w_i, const Pose3& T_w_j, const Range& range,
                         double sigma_m);

}  // namespace tutti::estimation
