// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle {

using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// Residual of an IMU factor between keyframes i and j, 15x1, order [rotation; velocity; position; gyro bias;
/// accelerometer bias] (rad, m/s, m, rad/s, m/s^2), Forster et al. (2017), eq. (45), with gravity g, world frame, a
/// variable:
///   r_R = Log((dR Exp(J_R db))^T R_i^T R_j)
///   r_v = R_i^T (v_j - v_i - g t) - (dv + J_v db)
///   r_p = R_i^T (p_j - p_i - v_i t - g t^2 / 2) - (dp + J_p db),   db = bias_i - bias of the linearisation
///   r_b = bias_j - bias_i, eq. (47)
/// Derivatives: poses by right perturbations [translation; rotation], motion by [velocity; gyro bias; accelerometer
/// bias], gravity by itself.
struct ImuLinearisation {
  Vector15d residual = Vector15d::Zero();
  Eigen::Matrix<double, 15, 6> J_pose_i = Eigen::Matrix<double, 15, 6>::Zero();
  Eigen::Matrix<double, 15, 9> J_motion_i = Eigen::Matrix<double, 15, 9>::Zero();
  Eigen::Matrix<double, 15, 6> J_pose_j = Eigen::Matrix<double, 15, 6>::Zero();
  Eigen::Matrix<double, 15, 9> J_motion_j = Eigen::Matrix<double, 15, 9>::Zero();
  Eigen::Matrix<double, 15, 3> J_gravity = Eigen::Matrix<double, 15, 3>::Zero();
};
ImuLinearisation linearise_imu(const Pose3& T_w_i, const MotionState& motion_i, const Pose3& T_w_j,
                               const MotionState& motion_j, const Eigen::Vector3d& gravity,
                               const ImuPreintegration& imu);

/// W with W^T W the information of that residual, from the full covariance of the preintegration and the random walks
/// of the biases (rad/s^2/sqrt(Hz), m/s^3/sqrt(Hz)). Zero when the covariance is not positive definite.
Matrix15d imu_root_information(const ImuPreintegration& imu, double gyro_random_walk, double accelerometer_random_walk);

/// Prior that keeps the problem determined when the motion does not, as of a robot that hovers: standard deviations of
/// [velocity m/s; gyro bias rad/s; accelerometer bias m/s^2] where a run of IMU factors begins, around zero velocity
/// and the biases of the first linearisation; and of the length of gravity.
Vector9d motion_prior_sigma();
inline constexpr double kGravity_mps2 = 9.81;
inline constexpr double kGravitySigma_mps2 = 0.01;

}  // namespace tutti::bundle
