// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/consistency/robot_node.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// One keyframe time of one robot, in the server's estimate and in its own.
struct NodePair {
  std::size_t proxy = 0;  ///< Position in ProxyGraph::nodes.
  std::size_t robot = 0;  ///< Position in the list of RobotNode.
  friend bool operator==(const NodePair&, const NodePair&) = default;
};

/// The result of synchronise().
struct Synchronisation {
  std::vector<NodePair> pairs;          ///< One-to-one, in time order.
  std::vector<std::size_t> eliminated;  ///< Positions of our nodes that the server's reduction removed, in time order.
};

/// Chronological matching by (chain, stamp) with exactly equal stamps, as the robot makes the stamps and they travel
/// unchanged. When a stamp occurs several times on a side, the first occurrences match each other, then the second
/// ones, and so on.
Synchronisation synchronise(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes);

}  // namespace tutti::consistency
