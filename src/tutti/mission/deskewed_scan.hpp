// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/result.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/mission/scan_times.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::mission {

/// T_odom_body, going on beyond either end as it went there, for as long as a point may be from its scan's pose: the
/// first sweep began before the odometry.
Trajectory with_ends(const Trajectory& odometry);

/// What a sensor at `T_body_lidar` measured, as if at once: in the body frame of the stamp. Without `times` the points
/// are taken as they are. `odometry`: with_ends(). Error: points have no such times.
Result<Scan> deskewed(formats::TimedCloud measured, Timestamp stamp, const std::optional<PointTimes>& times,
                      const Pose3& T_body_lidar, const Trajectory& odometry);

}  // namespace tutti::mission
