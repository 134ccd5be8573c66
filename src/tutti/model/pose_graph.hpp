// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A relative-pose factor. `from` and `to` index PoseGraph::poses; the residual is local(T_from_to, T_from^-1 T_to), a
/// tangent [translation m; rotation rad], and `information` is the inverse covariance in that tangent.
struct PoseGraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose3 T_from_to;
  Matrix6d information = Matrix6d::Identity();
};

/// Poses T_world_node with the factors between them.
struct PoseGraph {
  std::vector<Pose3> poses;
  std::vector<PoseGraphEdge> edges;
};

}  // namespace tutti
