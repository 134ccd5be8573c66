// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency {

/// One of a robot's own representative nodes with its corrected estimate. Lists of them are in time order.
struct RobotNode {
  Timestamp stamp;
  Pose3 T_map_body;
  std::size_t chain_index = 0;  ///< Position in the robot's odometry chain.
  RelativePose odometry;        ///< Raw odometry from the previous node of the list; unused for the first.
  std::uint32_t submap = 0;     ///< SubmapId::index of the submap that the node belongs to.
  friend bool operator==(const RobotNode&, const RobotNode&) = default;
};

}  // namespace tutti::consistency
