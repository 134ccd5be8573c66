// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

/// The roles of a graph whose first `odometry_edges` edges are odometry, which is trusted, and all others closures.
inline std::vector<EdgeRole> roles_of(const PoseGraph& graph, std::size_t odometry_edges) {
  std::vector<EdgeRole> out(graph.edges.size(), EdgeRole::robust);
  std::fill_n(out.begin(), odometry_edges, EdgeRole::trusted);
  return out;
}

}  // namespace tutti::estimation
