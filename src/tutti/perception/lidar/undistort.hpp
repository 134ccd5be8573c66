// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::lidar {

/// A sweep as if measured at once: every point in the body frame at the scan's stamp, without ages. A point of age a
/// was measured a seconds before the stamp (after it, if negative), in the body frame of that time. The body's motion
/// is the robot's odometry `T_odom_body` (increasing stamps, any frame), straight and of constant turn rate between two
/// samples. A scan without ages comes back as it is. Errors (ErrorCode::invalid): no cloud, not one age per point, an
/// age that is not finite or outside of the odometry's time.
Result<Scan> undistort(const Scan& scan, std::span<const StampedPose> T_odom_body);

}  // namespace tutti::lidar
