// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// The limits of a group. Neighbours are as near in time as one submap is long; segments longer than three submaps do
/// not resemble each other; larger groups cost more to test than they are worth.
struct GroupLimits {
  double near_s = 10.0;
  double longest_s = 30.0;
  std::size_t most_closures = 24;

  /// Closures of neighbouring submaps, which may be wrong all together, however long they last.
  static GroupLimits of_neighbours() {
    return {15.0, std::numeric_limits<double>::infinity(), std::numeric_limits<std::size_t>::max()};
  }
};

/// Groups `closures` (positions in `edges`, which join `nodes`) that are about one pair of places. Each closure of a
/// group is within limits.near_s of another one of it at both ends, on the same two chains. Two places that look alike
/// make all closures between them wrong, so however many they are they count as one witness. Groups that exceed
/// limits.longest_s on either chain, or limits.most_closures, are left out. Groups are ordered by their first closures.
std::vector<std::vector<std::size_t>> closure_groups(const std::vector<MapNode>& nodes,
                                                     std::span<const PoseGraphEdge> edges,
                                                     std::span<const std::size_t> closures,
                                                     const GroupLimits& limits = {});

}  // namespace tutti::judge
