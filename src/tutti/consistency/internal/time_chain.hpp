// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/consistency/policy.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency::internal {

/// One robot's synchronised nodes in time order: where both sides have them, and the raw odometry between them.
struct TimeChain {
  std::vector<Pose3> server;           ///< T_world_body.
  std::vector<Pose3> robot;            ///< T_map_body, as corrected so far.
  std::vector<RelativePose> odometry;  ///< k - 1 -> k; entry 0 unused. Robot nodes between two pairs are passed over.
};

TimeChain time_chain(const ProxyGraph& graph, std::span<const RobotNode> nodes, std::span<const NodePair> pairs);

/// Root mean square distance of the nodes after one rigid alignment, m; not empty.
double aligned_rmse(std::span<const Pose3> server, std::span<const Pose3> robot);

}  // namespace tutti::consistency::internal
