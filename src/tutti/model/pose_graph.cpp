// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/pose_graph.hpp"

#include "tutti/base/disjoint_sets.hpp"

namespace tutti {

std::pair<std::vector<int>, int> components(const PoseGraph& graph) {
  DisjointSets sets(graph.poses.size());
  for (const PoseGraphEdge& edge : graph.edges) sets.join(edge.from, edge.to);
  return sets.labels();
}

std::size_t degrees_of_freedom(const PoseGraph& graph) {
  return 6 * (graph.edges.size() + static_cast<std::size_t>(components(graph).second) - graph.poses.size());
}

}  // namespace tutti
