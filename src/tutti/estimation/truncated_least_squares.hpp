// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "tutti/estimation/gnc.hpp"

namespace tutti::estimation {

/// Minimises the sum over the edges of min(r^T Omega r, truncation[edge]) by graduated non-convexity (gnc.hpp), on the
/// graph as it is, without compounding runs. An edge with an infinite truncation is trusted. `start`: the solution
/// without truncations, least_squares() of the same graph. `fixed`: nodes that keep their poses (fixed_nodes.hpp).
/// config.confidence is not used. `stop`: as in fixed_nodes.hpp.
GncResult truncated_least_squares(const PoseGraph& graph, const GncConfig& config, std::span<const double> truncation,
                                  const PoseGraphSolution& start, std::span<const std::size_t> fixed = {},
                                  const std::function<bool()>& stop = {});
/// solve_pose_graph() with config.solver, without any loss.
PoseGraphSolution least_squares(const PoseGraph& graph, const GncConfig& config,
                                std::span<const std::size_t> fixed = {}, const std::function<bool()>& stop = {});

}  // namespace tutti::estimation
