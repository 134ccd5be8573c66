// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

/// A pose graph without the nodes that only pass trusted odometry on: each run of steps between two other nodes is one
/// edge, compounded to first order about the raw odometry.
struct ReducedGraph {
  PoseGraph graph;
  std::vector<EdgeRole> roles;
  /// Per edge of the original: its edge here; nothing for a step within a run.
  std::vector<std::optional<std::size_t>> edge;

  /// A run: edges of the original from node begin to node end, in order.
  struct Run {
    std::size_t edge = 0;  ///< Here.
    std::vector<std::size_t> steps;
  };
  std::vector<std::size_t> nodes;  ///< Of the original, increasing.
  std::vector<Run> runs;
};

/// Only steps with from < to are compounded; `fixed` nodes stay. `roles`: per edge, or empty: all robust, so nothing
/// is. With `about`, poses of all nodes, runs are linearised there, and the reduced graph's equations at those poses
/// are the whole graph's without the nodes that are left out.
ReducedGraph reduce_chains(const PoseGraph& graph, std::span<const EdgeRole> roles,
                           std::span<const std::size_t> fixed = {}, std::span<const Pose3> about = {});

/// Poses of all nodes of the original from those of the reduced graph: every run is bent to meet its ends.
void expand_chains(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> reduced_poses,
                   std::vector<Pose3>& poses);

/// To first order about the poses that the graph was reduced about: how all nodes of the original move with those of
/// the reduced one; right tangents, 6 rows a node, any number of columns.
Eigen::MatrixXd expand_moves(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> about,
                             const Eigen::MatrixXd& reduced_moves);

}  // namespace tutti::estimation
