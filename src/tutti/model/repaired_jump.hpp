// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/timestamp.hpp"

namespace tutti {

/// Somewhere between these stamps odometry jumped, and the correction is made there: by how much.
struct RepairedJump {
  Timestamp from;
  Timestamp until;
  double translation_m = 0.0;
  double rotation_rad = 0.0;
  friend bool operator==(const RepairedJump&, const RepairedJump&) = default;
};

}  // namespace tutti
