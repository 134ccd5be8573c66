// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Relative-pose factor between nodes by position in PoseGraph::poses. Residual: local(T_from_to, T_from^-1 T_to),
/// information in that tangent [translation; rotation].
struct PoseGraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose3 T_from_to;
  Matrix6d information = Matrix6d::Identity();
};

struct PoseGraph {
  std::vector<Pose3> poses;
  std::vector<PoseGraphEdge> edges;
};

}  // namespace tutti
