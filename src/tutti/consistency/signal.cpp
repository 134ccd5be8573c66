// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/signal.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency {
namespace {

Eigen::Index count(std::span<const Pose3> poses) { return static_cast<Eigen::Index>(poses.size()); }

/// [translation; the nine entries of the rotation matrix over sqrt(2)]: no jumps at half a turn.
Eigen::RowVectorXd embedded(const Pose3& T) {
  Eigen::RowVectorXd row(12);
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix() / std::numbers::sqrt2;
  row << T.translation.transpose(), R.reshaped().transpose();
  return row;
}

/// Rotation vector of the robot's turn against the server's, in the axes of the server's frame.
Eigen::Vector3d rotation_error(const Eigen::Quaterniond& server, const Eigen::Quaterniond& robot) {
  return so3_log(robot * server.conjugate());
}

}  // namespace

Eigen::MatrixXd DistanceSignal::evaluate(std::span<const Pose3> poses) const {
  Eigen::MatrixXd f(count(poses), 1);
  for (std::size_t n = 0; n < poses.size(); ++n)
    f(static_cast<Eigen::Index>(n), 0) = (poses[n].translation - poses[0].translation).norm();
  return f;
}

Eigen::MatrixXd DistanceSignal::difference(std::span<const Pose3> server, std::span<const Pose3> robot) const {
  return evaluate(robot) - evaluate(server);
}

Eigen::MatrixXd PoseSignal::evaluate(std::span<const Pose3> poses) const {
  Eigen::MatrixXd f(count(poses), 12);
  for (std::size_t n = 0; n < poses.size(); ++n)
    f.row(static_cast<Eigen::Index>(n)) = embedded(poses[0].inverse() * poses[n]);
  return f;
}

Eigen::MatrixXd PoseSignal::difference(std::span<const Pose3> server, std::span<const Pose3> robot) const {
  TUTTI_CHECK(server.size() == robot.size(), "{} and {} poses", server.size(), robot.size());
  Eigen::MatrixXd f(count(server), 6);
  if (server.empty()) return f;
  std::vector<Eigen::Vector3d> x_server, x_robot;
  for (std::size_t n = 0; n < server.size(); ++n) {
    x_server.push_back(server[n].translation);
    x_robot.push_back(robot[n].translation);
  }
  const Pose3 T = align_points(x_server, x_robot);
  for (std::size_t n = 0; n < server.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    f.row(row).head<3>() = (T * x_robot[n] - x_server[n]).transpose();
    f.row(row).tail<3>() = rotation_error(server[n].rotation, T.rotation * robot[n].rotation).transpose();
  }
  f.rightCols<3>().rowwise() -= f.rightCols<3>().colwise().mean().eval();
  return f;
}

Eigen::MatrixXd RelativeMotionSignal::evaluate(std::span<const Pose3> poses) const {
  Eigen::MatrixXd f(count(poses), 12);
  for (std::size_t n = 0; n < poses.size(); ++n)
    f.row(static_cast<Eigen::Index>(n)) = embedded(n == 0 ? Pose3{} : poses[n - 1].inverse() * poses[n]);
  return f;
}

Eigen::MatrixXd RelativeMotionSignal::difference(std::span<const Pose3> server, std::span<const Pose3> robot) const {
  TUTTI_CHECK(server.size() == robot.size(), "{} and {} poses", server.size(), robot.size());
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(count(server), 6);
  for (std::size_t n = 1; n < server.size(); ++n) {
    const Pose3 step_server = server[n - 1].inverse() * server[n];
    const Pose3 step_robot = robot[n - 1].inverse() * robot[n];
    const Eigen::Quaterniond& R = server[n - 1].rotation;
    const auto row = static_cast<Eigen::Index>(n);
    f.row(row).head<3>() = (R * (step_robot.translation - step_server.translation)).transpose();
    f.row(row).tail<3>() = (R * rotation_error(step_server.rotation, step_robot.rotation)).transpose();
  }
  return f;
}

Result<std::unique_ptr<Signal>> make_signal(const std::string& name) {
  if (name == "distance") return std::make_unique<DistanceSignal>();
  if (name == "pose") return std::make_unique<PoseSignal>();
  if (name == "relative_motion") return std::make_unique<RelativeMotionSignal>();
  return fail(ErrorCode::configuration, "signal '{}' is unknown, expected distance, pose or relative_motion", name);
}

}  // namespace tutti::consistency
