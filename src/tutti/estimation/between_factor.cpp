// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/between_factor.hpp"

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {

Vector6d between_residual(const Pose3& T_w_i, const Pose3& T_w_j, const Pose3& T_i_j_meas) {
  const Eigen::Quaterniond q_i_w = T_w_i.rotation.conjugate();
  const Eigen::Quaterniond q_meas = T_i_j_meas.rotation.conjugate();
  Vector6d r;
  r.head<3>() = q_meas * (q_i_w * (T_w_j.translation - T_w_i.translation) - T_i_j_meas.translation);
  r.tail<3>() = so3_log(q_meas * (q_i_w * T_w_j.rotation));
  return r;
}

BetweenLinearisation linearise_between(const Pose3& T_w_i, const Pose3& T_w_j, const Pose3& T_i_j_meas) {
  const Eigen::Matrix3d R_i_w = T_w_i.rotation.toRotationMatrix().transpose();
  const Eigen::Quaterniond q_i_j = T_w_i.rotation.conjugate() * T_w_j.rotation;
  const Eigen::Matrix3d R_j_i = q_i_j.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_meas = T_i_j_meas.rotation.toRotationMatrix();
  const Eigen::Vector3d t_i_j = R_i_w * (T_w_j.translation - T_w_i.translation);

  BetweenLinearisation out;
  out.residual.head<3>() = R_meas.transpose() * (t_i_j - T_i_j_meas.translation);
  out.residual.tail<3>() = so3_log(T_i_j_meas.rotation.conjugate() * q_i_j);
  const Eigen::Matrix3d Jr_inv = so3_right_jacobian_inverse(out.residual.tail<3>());

  // J_j = diag(R_meas^T R_ij, Jr^-1(Log)); J_i = -J_j Ad(T_ij^-1).
  out.J_j.setZero();
  out.J_j.topLeftCorner<3, 3>() = R_meas.transpose() * R_j_i.transpose();
  out.J_j.bottomRightCorner<3, 3>() = Jr_inv;
  out.J_i.topLeftCorner<3, 3>() = -R_meas.transpose();
  out.J_i.topRightCorner<3, 3>() = R_meas.transpose() * skew(t_i_j);
  out.J_i.bottomLeftCorner<3, 3>().setZero();
  out.J_i.bottomRightCorner<3, 3>() = -Jr_inv * R_j_i;
  return out;
}

}  // namespace tutti::estimation
