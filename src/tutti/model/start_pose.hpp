// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/base/result.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti {

/// Where somebody says that a robot is now, in a map that does not move: a prior for whoever localises it there, never
/// an order.
struct StartPose {
  /// In the map's frame; right tangent. Nothing: nobody knows, and the whole map is to be searched.
  std::optional<RelativePose> T_world_body;
  /// Only x, y and heading are meant, as where somebody has clicked on a plan; the rest is as the map's robots stood
  /// there. Then the covariance's other rows are not read.
  bool is_planar = false;
  /// The floor of the map in whose frame the pose is; nothing: it may be any of them.
  std::optional<std::uint32_t> floor;
};

/// Fails, saying which number is wrong, when pose or covariance are not finite or the covariance is none.
Status check_start_pose(const StartPose& start);

}  // namespace tutti
