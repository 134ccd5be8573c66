// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

/// The solvers for graphs with nodes to be fixed (g2o's FIX). The nodes `fixed` (positions) keep their given poses,
/// whatever the edges between them measure; in a connected component without a fixed node the first node keeps its
/// pose, as without this argument. `stop` is asked before every step; once it is true none follows, and the solution is
/// what is there, with the termination max_iterations.
namespace tutti::estimation {

PoseGraphSolution solve_pose_graph(const PoseGraph& graph, const SolverConfig& config, std::span<const EdgeRole> roles,
                                   std::span<const std::size_t> fixed, const std::function<bool()>& stop = {});
GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles,
                               std::span<const std::size_t> fixed, const std::function<bool()>& stop = {});

}  // namespace tutti::estimation
