// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/result.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/lidar/scan_times.hpp"

namespace tutti::lidar {

/// The trajectory T_odom_body (at least one pose), extrapolated at both ends at constant velocity by kLongestAge_s: the
/// first sweep may have begun before the odometry, and points may be later than the last pose.
Trajectory with_ends(const Trajectory& odometry);

/// The points of a sweep, measured in the sensor's frame, as if measured at once: in the body frame at `stamp`. Without
/// `times` they are only transformed; with them, points that drop_stray_times() takes out are left out. `odometry`:
/// with_ends(). `stamp` and absolute times are by the sensor's clock; with `offset_s` added they are odometry's. Errors
/// are those of point_ages() and undistort().
Result<Scan> deskewed(formats::TimedCloud measured, Timestamp stamp, const std::optional<PointTimes>& times,
                      const Pose3& T_body_lidar, const Trajectory& odometry, double offset_s = 0.0);

}  // namespace tutti::lidar
