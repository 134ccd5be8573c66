// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::lidar {

/// The sweep as if measured at once: every point in the body frame of the scan's stamp, no ages. The body's motion is
/// the robot's own odometry `T_odom_body` (stamps increasing, any frame), straight and of constant turn between two
/// samples. A scan without ages comes back as it is.
/// A negative age is after the stamp.
/// Error: no cloud; as many ages as points are needed, each finite and within the odometry's time.
Result<Scan> undistort(const Scan& scan, std::span<const StampedPose> T_odom_body);

}  // namespace tutti::lidar
