// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/consistency/robot_node.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// The same moment of one robot in the server's and in its own estimate.
struct NodePair {
  std::size_t proxy = 0;  ///< Position in ProxyGraph::nodes.
  std::size_t robot = 0;  ///< Position in the list of RobotNode.
  friend bool operator==(const NodePair&, const NodePair&) = default;
};

struct Synchronisation {
  std::vector<NodePair> pairs;          ///< One-to-one, in time order.
  std::vector<std::size_t> eliminated;  ///< Our nodes that the server's reduction removed; in time order.
};

/// Chronological matching by (robot, stamp), stamps exactly equal: the robot makes the stamps and they travel
/// unchanged. A stamp that occurs more than once on a side is matched once per occurrence on the other, first to first.
Synchronisation synchronise(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes);

}  // namespace tutti::consistency
