// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

/// A pose graph without the nodes that only pass trusted odometry on. A node is left out when exactly one trusted step
/// enters it, one leaves it and it has no other edge; each run of such steps between two remaining nodes becomes one
/// edge, compounded to first order.
struct ReducedGraph {
  PoseGraph graph;
  std::vector<EdgeRole> roles;
  /// Per edge of the original graph its edge in `graph`; no value for a step of a run.
  std::vector<std::optional<std::size_t>> edge;

  /// A run of odometry steps that became one edge.
  struct Run {
    std::size_t edge = 0;            ///< Position in graph.edges.
    std::vector<std::size_t> steps;  ///< Edges of the original graph, in order.
  };
  std::vector<std::size_t> nodes;  ///< Per node of `graph` its position in the original graph, increasing.
  std::vector<Run> runs;
};

/// Reduces a graph. Only steps with from < to are compounded; `fixed` nodes (positions) stay. `roles`: per edge; empty
/// means all robust, and then nothing is compounded. Runs are linearised about the raw odometry, or, with `about`,
/// about these poses (one per node): the normal equations of the reduced graph at these poses are then those of the
/// whole graph with the left-out nodes eliminated.
ReducedGraph reduce_chains(const PoseGraph& graph, std::span<const EdgeRole> roles,
                           std::span<const std::size_t> fixed = {}, std::span<const Pose3> about = {});

/// Writes into `poses` (one per node of the original graph) the poses that follow from those of the reduced graph:
/// every run is bent to meet its ends, each step in proportion to its covariance.
void expand_chains(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> reduced_poses,
                   std::vector<Pose3>& poses);

/// How all nodes of the original graph move with those of the reduced one, to first order about `about`, the poses that
/// the graph was reduced about. Right tangents, 6 rows per node, any number of columns.
Eigen::MatrixXd expand_moves(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> about,
                             const Eigen::MatrixXd& reduced_moves);

}  // namespace tutti::estimation
