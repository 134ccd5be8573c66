// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/beliefs.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// What carries a change of one chain's trajectory from one map to the next.
struct ChangeSupport {
  /// The closures of the one pair of places that the change rests on: without them the chain lies nearer to the older
  /// map than to the newer one. 0: the change would survive the loss of any one group.
  std::size_t lone_closures = 0;
  int factorisations = 0;  ///< What it took to find out, of the graph of the closures' ends.
  int tried = 0;           ///< Groups without which the map was solved.
};

/// Looks for one group of closures (judge/closure_groups.hpp) on which the difference between `map` and the map that a
/// robot follows rests. Groups with a closure that the followed map did not accept are tried, the largest first; all
/// groups where there is none. `followed` and `own`: the robot's part (consistency::own_part) of the followed map and
/// of this one; both have nodes of `chain`. The poses without a group are least squares with all other accepted
/// closures and the odometry as the map counts it. Groups that move the chain by far less than it has changed, to first
/// order (estimation::group_removals), are not tried: in the map of a large fleet nearly all. Where more than 16 are
/// left, those that move it most are tried.
ChangeSupport change_support(const MapEstimate& map, const Beliefs& followed_beliefs, const ProxyGraph& followed,
                             const ProxyGraph& own, const ChainId& chain, const estimation::SolverConfig& solver);

}  // namespace tutti::server
