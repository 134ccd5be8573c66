// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/odometry_drift.hpp"

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::consistency::internal {

OdometryDrift::OdometryDrift(std::span<const Pose3> server, std::span<const RelativePose> odometry) {
  TUTTI_CHECK(server.size() == odometry.size(), "{} poses, {} steps", server.size(), odometry.size());
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Pose3& T : server) centroid += T.translation / static_cast<double>(server.size());
  const auto centred = [&](std::size_t k) { return Pose3{server[k].rotation, server[k].translation - centroid}; };
  for (std::size_t k = 0; k < server.size(); ++k) {
    const Pose3 T = centred(k);
    Node node{.x = T.translation, .E = Vector6d::Zero(), .step = Matrix6d::Zero()};
    if (k > 0) {
      // T_before odometry = exp(e) T: what the step is off by, as a motion of space.
      const Pose3 off = centred(k - 1) * odometry[k].T_a_b * T.inverse();
      node.E << off.translation, so3_log(off.rotation);
      node.E += nodes_.back().E;
      const Matrix6d Ad = adjoint(T);
      node.step = Ad * odometry[k].covariance * Ad.transpose();
    }
    nodes_.push_back(node);
  }
}

Vector6d OdometryDrift::at_node(std::size_t node, const Vector6d& motion) const {
  Vector6d out;
  out << motion.head<3>() + motion.tail<3>().cross(nodes_[node].x), motion.tail<3>();
  return out;
}

Vector6d OdometryDrift::missed(std::size_t a, std::size_t b) const { return at_node(b, nodes_[b].E - nodes_[a].E); }

Eigen::MatrixXd OdometryDrift::with_fixed(std::span<const std::size_t> fixed) const {
  TUTTI_CHECK(!fixed.empty() && fixed.back() < size(), "{} of {} nodes fixed", fixed.size(), size());
  Eigen::MatrixXd out(static_cast<Eigen::Index>(size()), 6);
  const auto write = [&](std::size_t k, const Vector6d& motion) {
    out.row(static_cast<Eigen::Index>(k)) = at_node(k, motion).transpose();
  };
  const auto write_free = [&](std::size_t first, std::size_t end, std::size_t from) {
    for (std::size_t k = first; k < end; ++k) write(k, nodes_[k].E - nodes_[from].E);
  };
  write_free(0, fixed.front() + 1, fixed.front());
  for (std::size_t j = 1; j < fixed.size(); ++j) {
    const std::size_t a = fixed[j - 1], b = fixed[j];
    Matrix6d S = Matrix6d::Zero();
    for (std::size_t k = a + 1; k <= b; ++k) S += nodes_[k].step;
    const Vector6d pull = solve_definite(S, nodes_[b].E - nodes_[a].E);
    S.setZero();
    for (std::size_t k = a + 1; k <= b; ++k) {
      S += nodes_[k].step;
      write(k, nodes_[k].E - nodes_[a].E - S * pull);
    }
  }
  write_free(fixed.back() + 1, size(), fixed.back());
  return out;
}

}  // namespace tutti::consistency::internal
