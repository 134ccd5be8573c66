// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/robot/sensor_timeline.hpp"

/// Which odometry a robot accepts, also for code that checks samples before the robot does.
namespace tutti::robot {

/// The sample as the robot uses it: the quaternion normalised where it is off by rounding (1e-3), the covariance given
/// an inverse and standard deviations of at most 10 m and 0.3 rad (geometry/covariance.hpp). An error states why the
/// sample is refused.
Result<OdometryStep> usable_step(RobotId robot, const OdometrySample& sample);
/// Covariance of a step of which nothing is known: the largest that a step may have.
Matrix6d unknown_step();
/// Fails unless the pose is finite, with a unit quaternion and within kMaxCoordinate_m, and check_covariance() passes.
Status check_step(RobotId robot, const OdometryStep& step);
/// Fails unless `stamp` is after `newest`.
Status check_follows(RobotId robot, Timestamp stamp, const std::optional<Timestamp>& newest);

}  // namespace tutti::robot
