// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// One representative keyframe as the server estimates it.
struct ProxyNode {
  RobotId robot;
  Timestamp stamp;
  Pose3 T_world_body;
  /// Covariance of this pose relative to the same robot's previous proxy node (right tangent); zero for the first.
  Matrix6d covariance = Matrix6d::Zero();
  /// Independent closures that support the stretch from the previous proxy node to this one (docs/math.md).
  std::uint32_t support = 0;
  friend bool operator==(const ProxyNode&, const ProxyNode&) = default;
};

/// Undirected edge between two nodes of one robot that the Kron reduction kept; indices into ProxyGraph::nodes.
struct ProxyEdge {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  double weight = 0.0;
  friend bool operator==(const ProxyEdge&, const ProxyEdge&) = default;
};

/// A node that the Kron reduction removed. The robot needs it to reduce its own graph to the same nodes.
struct EliminatedNode {
  RobotId robot;
  Timestamp stamp;
  friend bool operator==(const EliminatedNode&, const EliminatedNode&) = default;
};

/// Which robots share one gauge: robots of different components have unrelated `world` frames.
struct RobotComponent {
  RobotId robot;
  std::uint32_t component = 0;
  friend bool operator==(const RobotComponent&, const RobotComponent&) = default;
};

/// The server's map in kilobytes. Unreduced, edges follow from the positions by one rule (radius, sigma; eqs. 1, 2) and
/// are not carried; reduced, `edges` and `eliminated` are.
struct ProxyGraph {
  std::uint64_t revision = 0;  ///< Counts up with every broadcast.
  double radius_m = 7.0;
  double sigma_m = 1.0;
  std::vector<ProxyNode> nodes;  ///< Sorted by (robot, stamp).
  std::vector<RobotComponent> components;
  bool reduced = false;
  std::vector<ProxyEdge> edges;
  std::vector<EliminatedNode> eliminated;  ///< Sorted by (robot, stamp).
  friend bool operator==(const ProxyGraph&, const ProxyGraph&) = default;
};

}  // namespace tutti
