// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/imu_factor.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::bundle {

ImuLinearisation linearise_imu(const Pose3& T_w_i, const MotionState& motion_i, const Pose3& T_w_j,
                               const MotionState& motion_j, const Eigen::Vector3d& gravity,
                               const ImuPreintegration& imu) {
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const double t = imu.duration_s;
  const Eigen::Matrix3d R_i_w = T_w_i.rotation.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_i_j = R_i_w * T_w_j.rotation.toRotationMatrix();
  Vector6d db;
  db << motion_i.gyro_bias - imu.gyro_bias, motion_i.accelerometer_bias - imu.accelerometer_bias;
  const Vector9d shift = imu.d_bias * db;
  const Eigen::Vector3d v_i_j = R_i_w * (motion_j.velocity - motion_i.velocity - gravity * t);
  const Eigen::Vector3d p_i_j =
      R_i_w * (T_w_j.translation - T_w_i.translation - motion_i.velocity * t - gravity * (0.5 * t * t));

  ImuLinearisation out;
  const Eigen::Quaterniond measured = imu.delta_rotation * so3_exp(shift.head<3>());
  const Eigen::Vector3d r_R = so3_log(measured.conjugate() * T_w_i.rotation.conjugate() * T_w_j.rotation);
  out.residual.head<3>() = r_R;
  out.residual.segment<3>(3) = v_i_j - imu.delta_velocity - shift.segment<3>(3);
  out.residual.segment<3>(6) = p_i_j - imu.delta_position - shift.tail<3>();
  out.residual.segment<3>(9) = motion_j.gyro_bias - motion_i.gyro_bias;
  out.residual.tail<3>() = motion_j.accelerometer_bias - motion_i.accelerometer_bias;

  const Eigen::Matrix3d Jr_inv = so3_right_jacobian_inverse(r_R);
  out.J_pose_i.block<3, 3>(0, 3) = -Jr_inv * R_i_j.transpose();
  out.J_pose_i.block<3, 3>(3, 3) = skew(v_i_j);
  out.J_pose_i.block<3, 3>(6, 0) = -I;
  out.J_pose_i.block<3, 3>(6, 3) = skew(p_i_j);
  out.J_pose_j.block<3, 3>(0, 3) = Jr_inv;
  out.J_pose_j.block<3, 3>(6, 0) = R_i_j;
  out.J_motion_i.block<3, 3>(3, 0) = -R_i_w;
  out.J_motion_i.block<3, 3>(6, 0) = -R_i_w * t;
  out.J_motion_i.block<9, 6>(0, 3) = -imu.d_bias;
  out.J_motion_i.block<3, 6>(0, 3) =
      -Jr_inv * so3_exp(-r_R).toRotationMatrix() * so3_right_jacobian(shift.head<3>()) * imu.d_bias.topRows<3>();
  out.J_motion_i.block<6, 6>(9, 3).setIdentity();
  out.J_motion_i.block<6, 6>(9, 3) *= -1.0;
  out.J_motion_j.block<3, 3>(3, 0) = R_i_w;
  out.J_motion_j.block<6, 6>(9, 3).setIdentity();
  out.J_gravity.block<3, 3>(3, 0) = -R_i_w * t;
  out.J_gravity.block<3, 3>(6, 0) = -R_i_w * (0.5 * t * t);
  return out;
}

Matrix15d imu_root_information(const ImuPreintegration& imu, double gyro_random_walk,
                               double accelerometer_random_walk) {
  Matrix15d W = Matrix15d::Zero();
  const Eigen::LLT<Matrix9d> llt(imu.covariance);
  if (llt.info() != Eigen::Success || !(imu.duration_s > 0.0)) return W;
  W.topLeftCorner<9, 9>() = llt.matrixL().solve(Matrix9d::Identity());
  const double root_t = std::sqrt(imu.duration_s);
  W.diagonal().segment<3>(9).setConstant(1.0 / (gyro_random_walk * root_t));
  W.diagonal().tail<3>().setConstant(1.0 / (accelerometer_random_walk * root_t));
  return W;
}

Vector9d motion_prior_sigma() {
  Vector9d sigma;
  sigma << Eigen::Vector3d::Constant(10.0), Eigen::Vector3d::Constant(0.1), Eigen::Vector3d::Constant(0.5);
  return sigma;
}

}  // namespace tutti::bundle
