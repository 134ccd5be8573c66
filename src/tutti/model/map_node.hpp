// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A keyframe in the server's map, with the server's estimate of its pose.
struct MapNode {
  KeyframeId id;
  Timestamp stamp;
  bool representative = false;
  Pose3 T_odom_body;            ///< Raw odometry.
  Pose3 T_world_body;           ///< The server's estimate, in the `world` of its component.
  std::uint32_t component = 0;  ///< Nodes of different components have unrelated world frames.
};

}  // namespace tutti
