// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

/// How the optimum changes without one group of edges.
struct Influence {
  std::size_t group = 0;  ///< Into the groups asked.
  double distance = 0.0;  ///< Mahalanobis length of `shift` in the covariance of all poses.
  /// 6 rows per node, right tangents: without the group the pose is retract(pose, shift), to first order.
  Eigen::VectorXd shift;
};

/// The groups of edges (positions in graph.edges) whose loss moves the optimum `poses` farthest in units of its
/// uncertainty: those of a distance above `least_distance`, at most `count`, farthest first. Case deletion (Cook,
/// "Detection of influential observations in linear regression", 1977), a group at a time: with r the whitened
/// residuals of the group's edges, J their whitened Jacobians, H the Hessian of all edges and K = J H^-1 J^T <= 1,
///   shift = H^-1 J^T (I - K)^-1 r,   distance^2 = shift^T H shift,
/// so one factorisation and one selected inverse serve all groups, and each chosen one takes one more solution. A group
/// that alone holds its ends together in some direction is left out: nothing else says where they would be. The first
/// node of each connected component does not move. Empty for a graph that does not determine its poses. `roles` as in
/// solve_pose_graph(); an edge of a group must not be within a run of trusted steps.
std::vector<Influence> largest_influences(const PoseGraph& graph, std::span<const Pose3> poses,
                                          std::span<const EdgeRole> roles,
                                          std::span<const std::vector<std::size_t>> groups, std::size_t count,
                                          double least_distance = 0.0);

/// Per group of edges (positions in graph.edges), how far the group moves the place that it is about, in units of what
/// the rest of the graph knows of that place. With x the relative pose between the ends of the group's middle edge, at
/// the optimum `poses` (with) and at the optimum of the graph without the group (without), and P the covariance of x in
/// the graph without the group:
///   (x_with - x_without)^T P^-1 (x_with - x_without),
/// which is at most chi-square with 6 degrees of freedom if the group's edges and all others are right, so all edges of
/// a group count as one witness. Zero where the rest knows nothing. To first order: with r the whitened residuals of
/// the group's edges, J their whitened Jacobians and K = J H^-1 J^T <= 1, the move is K (I - K)^-1 r and its covariance
/// K (I - K)^-1, both at the middle edge. One selected inverse serves all groups. Zeros for a graph that does not
/// determine its poses. `roles` as in solve_pose_graph(); an edge of a group must not be within a run of trusted steps.
std::vector<double> group_misfits(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                                  std::span<const std::vector<std::size_t>> groups);

}  // namespace tutti::estimation
