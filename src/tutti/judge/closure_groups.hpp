// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// Neighbours are as near as what a submap saw. Longer ways than by three submaps in a row do not look alike, and
/// larger groups cost more than they are worth.
struct GroupLimits {
  double near_s = 10.0;
  double longest_s = 30.0;
  std::size_t most_closures = 24;
};

/// Closures (positions in `edges`, between `nodes`) that tell about one pair of places: each is as near to another
/// one of its group at both ends, on the same two chains. What made one of them wrong, two places that look alike, made
/// the others wrong, too, so however many they are, they are one witness. Left out are groups that are longer than the
/// limit on either chain or of more closures. By their first closures.
std::vector<std::vector<std::size_t>> closure_groups(const std::vector<MapNode>& nodes,
                                                     std::span<const PoseGraphEdge> edges,
                                                     std::span<const std::size_t> closures,
                                                     const GroupLimits& limits = {});

}  // namespace tutti::judge
