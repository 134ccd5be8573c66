// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A pose at a time.
struct StampedPose {
  Timestamp stamp;
  Pose3 pose;  ///< T_frame_body; the owner of the trajectory names the frame.
  friend bool operator==(const StampedPose&, const StampedPose&) = default;
};

/// Poses with strictly increasing stamps.
using Trajectory = std::vector<StampedPose>;

}  // namespace tutti
