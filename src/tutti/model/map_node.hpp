// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A keyframe of a robot in the server's map.
struct MapNode {
  KeyframeId id;
  Timestamp stamp;
  bool representative = false;
  Pose3 T_odom_body;            ///< Raw odometry.
  Pose3 T_world_body;           ///< The estimate.
  std::uint32_t component = 0;  ///< Nodes of different components have unrelated world frames.
};

}  // namespace tutti
