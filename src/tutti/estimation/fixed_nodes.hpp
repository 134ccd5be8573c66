// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>

#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

/// The solvers for graphs that say which nodes stay where they are (g2o's FIX): `fixed`, by position, keep their given
/// poses, whatever the edges between them say. In a connected component without any the first node does, as ever.
namespace tutti::estimation {

PoseGraphSolution solve_pose_graph(const PoseGraph& graph, const SolverConfig& config, std::span<const EdgeRole> roles,
                                   std::span<const std::size_t> fixed);
GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles,
                               std::span<const std::size_t> fixed);

}  // namespace tutti::estimation
