// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti {

/// One robot's recorded or simulated run: everything a mission replays.
struct Recording {
  RobotId robot;
  std::string name;
  Trajectory odometry;                         ///< T_odom_body, raw, drifting.
  std::vector<Matrix6d> increment_covariance;  ///< Of odometry k -> k + 1; one fewer than odometry.
  Trajectory reference;                 ///< T_reference_body, one frame for all robots; empty when there is none.
  std::vector<std::string> scan_files;  ///< Empty, or one per odometry pose (body frame); "" = no scan there.
};

}  // namespace tutti
