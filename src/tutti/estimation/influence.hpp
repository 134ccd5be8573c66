// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

/// What becomes of the optimum when one edge is taken away.
struct Influence {
  std::size_t edge = 0;   ///< Into graph.edges.
  double distance = 0.0;  ///< Mahalanobis length of `shift` in the covariance of all poses.
  Eigen::VectorXd
      shift;  ///< 6 per node, right tangents: the pose without the edge is retract(pose, shift), first order.
};

/// The edges among `candidates` whose absence moves the optimum `poses` farthest for what is known of it, by more than
/// `least_distance`, at most `count`, farthest first. Case deletion (Cook, "Detection of influential observations in
/// linear regression", 1977): with residual r, Jacobian J and information Omega of the edge, H the Hessian of all edges
/// and C = J H^-1 J^T,
///   shift = H^-1 J^T (Omega^-1 - C)^-1 r,   distance^2 = shift^T H shift,
/// so one selected inverse serves all candidates, and one solution each the chosen ones. In directions in which nothing
/// but the edge holds its two ends together it has no residual and, taken away, moves nothing. The first node of each
/// connected component does not move. Empty for a graph that does not determine its poses.
std::vector<Influence> largest_influences(const PoseGraph& graph, std::span<const Pose3> poses,
                                          std::span<const std::size_t> candidates, std::size_t count,
                                          double least_distance = 0.0);

/// Per group of edges, what taking all of it away changes where it is, for what the rest knows of it: with x the
/// relative pose between the ends of the group's middle edge, at the optimum `poses` and at that of the graph without
/// the group, and P its covariance in the latter,
///   (x_with - x_without)^T P^-1 (x_with - x_without),
/// below chi-square with 6 degrees of freedom if the group's edges and all others are right: all edges of a group count
/// as one witness. Zero where the rest knows nothing. First order, and exact then: with K what the group knows of its
/// own edges (whitened, J H^-1 J^T, at most 1) and r their residuals, the move is K (I - K)^-1 r, its covariance
/// K (I - K)^-1. One selected inverse serves all groups. Zeros for a graph that does not determine its poses.
std::vector<double> group_misfits(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                                  std::span<const std::vector<std::size_t>> groups);

}  // namespace tutti::estimation
