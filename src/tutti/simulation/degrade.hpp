// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::simulation {

/// Errors of a bad front end that are added to given odometry. Their signs may differ from robot to robot.
struct DegradeConfig {
  double yaw_deg_per_m = 0.0;
  double scale_percent = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("yaw_deg_per_m", yaw_deg_per_m, between(-90.0, 90.0), "Yaw drift per metre travelled, about odom z.");
    v.field("scale_percent", scale_percent, between(-90.0, 90.0), "Scale error of every step.");
  }
};

/// Scales every step, and turns it about the z axis of the odometry frame by the yaw drift of the distance so far. Roll
/// and pitch keep their values, and so does the first pose.
Trajectory degrade_odometry(const Trajectory& odometry, const DegradeConfig& config);

/// Draws a frame: any yaw, a tilt of up to `max_tilt_deg` about a horizontal axis, and a shift of up to `max_shift_m`
/// along each axis.
Pose3 random_frame(Rng& rng, double max_tilt_deg = 3.0, double max_shift_m = 50.0);

/// The trajectory in another frame: T_new_odom T_odom_body. Steps and their covariances do not change.
Trajectory move_frame(const Trajectory& trajectory, const Pose3& T_new_odom);

}  // namespace tutti::simulation
