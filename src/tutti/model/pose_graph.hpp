// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A relative-pose factor. `from` and `to` index PoseGraph::poses; the residual is local(T_from_to, T_from^-1 T_to), a
/// tangent [translation m; rotation rad], and `information` is the inverse covariance in that tangent.
struct PoseGraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose3 T_from_to;
  Matrix6d information = Matrix6d::Identity();
};

/// Poses T_world_node with the factors between them.
struct PoseGraph {
  std::vector<Pose3> poses;
  std::vector<PoseGraphEdge> edges;
};

/// Per node the number of its connected component, in the order of their first nodes, and how many there are.
std::pair<std::vector<int>, int> components(const PoseGraph& graph);

/// By how many numbers the edges measure more than the poses need: 6 (edges + components - nodes). The sum of
/// r^T Omega r of solved poses is about as large where everything errs by what it states.
std::size_t degrees_of_freedom(const PoseGraph& graph);

}  // namespace tutti
