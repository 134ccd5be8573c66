// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/signal.hpp"

#include <algorithm>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency {

Eigen::MatrixXd evaluate_signal(const std::string& name, std::span<const Pose3> poses) {
  const bool distance = name == "distance", pose = name == "pose";
  TUTTI_CHECK(distance || pose || name == "relative_motion", "signal '{}' is unknown", name);
  Eigen::MatrixXd f(static_cast<Eigen::Index>(poses.size()), distance ? 1 : 3);
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    if (distance)
      f(row, 0) = (poses[n].translation - poses[0].translation).norm();
    else
      f.row(row) = (poses[pose ? 0 : std::max<std::size_t>(n, 1) - 1].inverse() * poses[n]).translation.transpose();
  }
  return f;
}

Eigen::MatrixXd pose_difference(std::span<const Pose3> server, std::span<const Pose3> robot) {
  TUTTI_CHECK(server.size() == robot.size(), "{} and {} poses", server.size(), robot.size());
  Eigen::MatrixXd f(static_cast<Eigen::Index>(server.size()), 6);
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
    f.row(row).tail<3>() = so3_log(T.rotation * robot[n].rotation * server[n].rotation.conjugate()).transpose();
  }
  f.rightCols<3>().rowwise() -= f.rightCols<3>().colwise().mean().eval();
  return f;
}

}  // namespace tutti::consistency
