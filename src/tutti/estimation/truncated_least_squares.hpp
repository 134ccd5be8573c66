// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>

#include "tutti/estimation/gnc.hpp"

namespace tutti::estimation {

/// Sum over the edges of min(r^T Omega r, truncation), made small by graduated non-convexity (gnc.hpp), on the graph as
/// it is. An edge with an infinite truncation is trusted. config.confidence is not used. `start`: the same without
/// truncations (least_squares()).
GncResult truncated_least_squares(const PoseGraph& graph, const GncConfig& config, std::span<const double> truncation,
                                  const PoseGraphSolution& start, std::span<const std::size_t> fixed = {});
PoseGraphSolution least_squares(const PoseGraph& graph, const GncConfig& config,
                                std::span<const std::size_t> fixed = {});

}  // namespace tutti::estimation
