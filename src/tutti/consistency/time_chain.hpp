// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/consistency/policy.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency {

/// One robot's synchronised nodes in time order: their poses on both sides, and the raw odometry between them.
struct TimeChain {
  std::vector<Pose3> server;  ///< T_world_body
  std::vector<Pose3> robot;   ///< T_map_body, as corrected so far
  /// From node k - 1 to k; entry 0 is unused. Compounded over robot nodes that are not synchronised.
  std::vector<RelativePose> odometry;
};

/// The time chain of `pairs`, which are in time order.
TimeChain time_chain(const ProxyGraph& graph, std::span<const RobotNode> nodes, std::span<const NodePair> pairs);

/// Root mean square distance between the nodes' positions after one rigid alignment, m; needs at least one node.
double aligned_rmse(std::span<const Pose3> server, std::span<const Pose3> robot);

}  // namespace tutti::consistency
