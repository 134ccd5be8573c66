// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// A pose graph of one or several robots, from anywhere. An edge from a robot's vertex to its next one (in either
/// direction) is odometry, the first such edge if there are several; every other edge is a closure.
struct RobotGraph {
  PoseGraph graph;  ///< Its poses are not used.
  /// Ids of the vertices of `graph`, increasing. Robots need no common frame or start.
  std::vector<KeyframeId> vertices;
  std::vector<Timestamp> stamps;  ///< Stamps of the vertices, increasing along each chain.
};

/// The verdict on one edge.
struct JudgedEdge {
  bool odometry = false;
  bool accepted = true;                                 ///< Always true for odometry, even where it failed.
  judge::Objection objection = judge::Objection::none;  ///< Why a closure is not accepted.
  judge::Price price;                                   ///< JudgedClosure::price
};

/// The result of judge_graph().
struct JudgedGraph {
  MapEstimate map;                ///< Its nodes are the vertices, without chains that cannot be solved (left_out).
  std::vector<JudgedEdge> edges;  ///< One per edge of the graph, in the same order.
};

/// Makes a map from any pose graph as the server does: decides which closures and which segments of odometry are wrong
/// (docs/math.md, "Outlier rejection"), and optimises with the others. The frame of each component is its first robot's
/// odometry frame.
JudgedGraph judge_graph(const RobotGraph& graph, const MapConfig& config);

}  // namespace tutti::server
