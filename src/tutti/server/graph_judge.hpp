// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Somebody's pose graph of one robot or several. An edge from a robot's vertex to its next one is odometry, the first
/// such edge where there are several, whichever way round; every other edge is a closure.
struct RobotGraph {
  PoseGraph graph;                   ///< Its poses are not used.
  std::vector<KeyframeId> vertices;  ///< Of graph.poses, increasing; robots need no common frame or start.
  std::vector<Timestamp> stamps;     ///< Of graph.poses, increasing along each chain.
};

/// What has become of an edge.
struct JudgedEdge {
  bool odometry = false;
  bool accepted = true;                                 ///< Of a closure; odometry is accepted, also where it failed.
  judge::Objection objection = judge::Objection::none;  ///< Of a closure that is not accepted.
};

struct JudgedGraph {
  MapEstimate map;                ///< Its nodes are the vertices, but for chains that cannot be solved (left_out).
  std::vector<JudgedEdge> edges;  ///< Of the graph's edges, in their order.
};

/// The server's map of a pose graph: decides which closures and which stretches of odometry are wrong (docs/math.md,
/// "Who is wrong?") and optimises with the others. Each component of the map has a frame of its own: the first odometry
/// frame in it.
JudgedGraph judge_graph(const RobotGraph& graph, const MapConfig& config);

}  // namespace tutti::server
