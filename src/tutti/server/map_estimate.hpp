// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/pairwise_consistency.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::server {

/// Everything the map is made from; kept sorted by id, so the map is a function of the set.
using SubmapSet = std::map<SubmapId, std::shared_ptr<const Submap>>;
using VerdictSet = std::map<SubmapPair, ClosureVerdict>;

struct MapNode {
  KeyframeId id;
  Timestamp stamp;
  bool representative = false;
  Pose3 T_odom_body;            ///< Raw odometry.
  Pose3 T_world_body;           ///< The estimate.
  std::uint32_t component = 0;  ///< Nodes of different components have unrelated world frames.
};

struct JudgedClosure {
  LoopClosure closure;
  bool accepted = false;
};

/// One joint map.
struct MapEstimate {
  std::vector<MapNode> nodes;           ///< Sorted by id.
  PoseGraph graph;                      ///< Same order as nodes: odometry, then the accepted closures.
  std::size_t odometry_edges = 0;       ///< graph.edges[0 .. odometry_edges) are odometry.
  std::vector<JudgedClosure> closures;  ///< Sorted by (from, to).
  std::uint32_t components = 0;         ///< Connected components that contain a node.
  bool converged = false;
};

struct MapConfig {
  estimation::PairwiseConsistencyConfig consistency;
  estimation::GncConfig gnc;
  int min_inter_robot_closures = 2;  ///< Fewer consistent closures than this do not join two robots.
  template <class V>
  void describe(V& v) {
    v.field("consistency", consistency);
    v.field("gnc", gnc);
    v.field("min_inter_robot_closures", min_inter_robot_closures, at_least(1.0),
            "Fewer mutually consistent closures than this do not join two robots.");
  }
};

/// The map of a set of submaps and verdicts: attaches submaps by their shared keyframes, rejects outliers, optimises.
/// Pure: the same sets give the same map, whatever the order they came in.
MapEstimate estimate_map(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config);

}  // namespace tutti::server
