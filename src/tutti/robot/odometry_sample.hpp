// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/robot/sensor_timeline.hpp"

/// What a robot takes of odometry, and what it refuses: for all that look at samples before it does, too.
namespace tutti::robot {

/// A sample as it is taken: the quaternion normalised where it is off by rounding only (1e-3), the covariance with
/// standard deviations of at most 10 m and 0.3 rad and an inverse (geometry/covariance.hpp). An error: it is refused.
Result<OdometryStep> usable_step(RobotId robot, Timestamp stamp, const Pose3& T_odom_body,
                                 const Matrix6d& increment_covariance);
/// Of a step of which nothing is known, as sure as any may be.
Matrix6d unknown_step();
/// The pose is finite, of a unit quaternion, within kMaxCoordinate_m; the covariance what check_covariance() says.
Status check_step(RobotId robot, const OdometryStep& step);
/// Stamps increase.
Status check_follows(RobotId robot, Timestamp stamp, const std::optional<Timestamp>& newest);

}  // namespace tutti::robot
