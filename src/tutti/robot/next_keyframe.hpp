// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::robot {

/// Determines when the next keyframe is due: after some travel, rotation or time since the last one.
struct NextKeyframe {
  /// T_odom_body of the last keyframe; nothing when there is none, and one is due at once.
  std::optional<StampedPose> last;
  double distance_m = 0.0;
  double angle_rad = 0.0;
  double time_s = 0.0;

  [[nodiscard]] bool is_due(const StampedPose& at) const {
    if (!last) return true;
    const Pose3 step = last->pose.inverse() * at.pose;
    return step.translation.norm() >= distance_m || rotation_angle(step) >= angle_rad ||
           at.stamp - last->stamp >= time_s;
  }
};

}  // namespace tutti::robot
