// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti {

/// Somewhere between these stamps odometry jumped, and the correction is made there: by how much.
struct RepairedJump {
  Timestamp from;
  Timestamp until;
  double translation_m = 0.0;
  double rotation_rad = 0.0;
  friend bool operator==(const RepairedJump&, const RepairedJump&) = default;
};

/// Of a step that odometry said to be one motion and the correction believes to be another.
inline RepairedJump repaired_jump(Timestamp from, Timestamp until, const Pose3& said, const Pose3& believed) {
  return {from, until, (believed.translation - said.translation).norm(), rotation_angle(said.inverse() * believed)};
}

}  // namespace tutti
