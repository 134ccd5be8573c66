// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/consistency/internal/odometry_error.hpp"

namespace tutti::consistency::internal {

/// Nodes to hold, sorted; links join neighbours.
struct JointPlan {
  std::vector<std::size_t> joints;
  std::vector<Vector6d> offsets;  ///< From where the server has them (OdometryError::fit).
  Eigen::MatrixXd residual;       ///< nodes x 6, what is left (OdometryError::residual).
  double squared_error = 0.0;     ///< m^2, summed over the nodes.
};

/// The best plan that holds these nodes.
JointPlan fit_joints(const OdometryError& error, std::vector<std::size_t> joints);

/// The joints, sorted, of the links that pay: at most `max_links` of them, as many as each lower the squared error
/// (m^2, summed over the nodes) by at least `least_gain`. Placed by optimal segmentation for joints held exactly where
/// the server has them, by dynamic programming over the number of links and the last joint (Bellman 1961), over at most
/// `candidates` evenly spread nodes, then all moved together to the best nodes around them. No links (one joint,
/// wherever raw odometry fits best) if none pays; no joint without nodes. The beginning before the first joint and the
/// end after the last hang on by odometry alone.
std::vector<std::size_t> place_joints(const OdometryError& error, std::size_t max_links, double least_gain,
                                      std::size_t candidates = 200);

}  // namespace tutti::consistency::internal
