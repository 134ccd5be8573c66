// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/degrade.hpp"

#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {

Trajectory degrade_odometry(const Trajectory& odometry, const DegradeConfig& config) {
  Trajectory degraded = odometry;
  double travelled_m = 0.0;
  for (std::size_t k = 1; k < odometry.size(); ++k) {
    const double yaw_before = kRadPerDeg * config.yaw_deg_per_m * travelled_m;
    const Eigen::Vector3d step = odometry[k].pose.translation - odometry[k - 1].pose.translation;
    travelled_m += step.norm();
    const double yaw_after = kRadPerDeg * config.yaw_deg_per_m * travelled_m;
    const Eigen::AngleAxisd turn_before(yaw_before, Eigen::Vector3d::UnitZ());
    const Eigen::AngleAxisd turn_after(yaw_after, Eigen::Vector3d::UnitZ());
    degraded[k].pose.translation =
        degraded[k - 1].pose.translation + (1.0 + 0.01 * config.scale_percent) * (turn_before * step);
    degraded[k].pose.rotation = (turn_after * odometry[k].pose.rotation).normalized();
  }
  return degraded;
}

Pose3 random_frame(Rng& rng, double max_tilt_deg, double max_shift_m) {
  const double yaw = rng.uniform(-std::numbers::pi, std::numbers::pi);
  const double tilt = kRadPerDeg * rng.uniform(0.0, max_tilt_deg);
  const double axis = rng.uniform(-std::numbers::pi, std::numbers::pi);
  Pose3 frame;
  for (double& coordinate : frame.translation) coordinate = rng.uniform(-max_shift_m, max_shift_m);
  frame.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(axis), std::sin(axis), 0.0)) *
                   Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  return frame;
}

Trajectory move_frame(const Trajectory& trajectory, const Pose3& T_new_odom) {
  Trajectory moved = trajectory;
  for (StampedPose& stamped : moved) stamped.pose = T_new_odom * stamped.pose;
  return moved;
}

}  // namespace tutti::simulation
