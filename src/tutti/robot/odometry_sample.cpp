// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/odometry_sample.hpp"

#include "tutti/geometry/covariance.hpp"

namespace tutti::robot {
namespace {

/// A step that states larger errors gets these: a robot moves less from one sample to the next. With 100 m and 3 rad
/// the graph of long runs of steps is so loose that it often has no solution.
constexpr double kUnknownStep_m = 10.0;
constexpr double kUnknownStep_rad = 0.3;

/// Quaternions printed with few digits are off by this much at most.
constexpr double kRoundedQuaternion = 1e-3;

}  // namespace

Result<OdometryStep> usable_step(RobotId robot, const OdometrySample& sample) {
  OdometryStep step{sample.stamp, sample.T_odom_body, sample.increment_covariance};
  if (is_valid(step.T_odom_body, kRoundedQuaternion)) step.T_odom_body.rotation.normalize();
  if (auto ok = check_step(robot, step); !ok) return tl::unexpected(ok.error());
  step.covariance = invertible_covariance(bounded_covariance(step.covariance, kUnknownStep_m, kUnknownStep_rad));
  return step;
}

Matrix6d unknown_step() {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kUnknownStep_m), Eigen::Vector3d::Constant(kUnknownStep_rad);
  return sigma.cwiseAbs2().asDiagonal();
}

Status check_step(RobotId robot, const OdometryStep& step) {
  const auto& [stamp, T_odom_body, covariance, is_jump] = step;
  if (!is_valid(T_odom_body))
    return fail(ErrorCode::invalid, "robot {}: odometry at {} ns is not a pose (|q| = {}, expected finite and 1)",
                robot.value, stamp.ns, T_odom_body.rotation.norm());
  if (const double largest = T_odom_body.translation.cwiseAbs().maxCoeff(); largest > kMaxCoordinate_m)
    return fail(ErrorCode::invalid, "robot {}: odometry at {} ns has a coordinate of {} m, at most {:.0f} m",
                robot.value, stamp.ns, largest, kMaxCoordinate_m);
  if (auto ok = check_covariance(covariance); !ok)
    return in_context(fmt::format("robot {}: odometry at {} ns", robot.value, stamp.ns), ok.error());
  return {};
}

Status check_follows(RobotId robot, Timestamp stamp, const std::optional<Timestamp>& newest) {
  if (!newest || stamp > *newest) return {};
  return fail(ErrorCode::invalid, "robot {}: odometry stamp {} ns does not follow {} ns", robot.value, stamp.ns,
              newest->ns);
}

}  // namespace tutti::robot
