// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <numbers>

/// Rotations, as unit quaternions, with tangent theta in R^3 (radians, right perturbation).
/// Equations: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018).
namespace tutti {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// By how much the norm of a quaternion in a file or message may differ from 1 before it is normalised: as tf2 takes
/// them, and as two decimals of a rotation of 90 degrees leave it.
inline constexpr double kUnitTolerance = 1e-2;

/// The matrix [v] of the cross product: skew(v) u = v x u.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Exp(theta), eqs. (101), (132); accurate for any |theta| (series below 1e-4).
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& theta);
/// Log(q), rad, |Log(q)| <= pi, eqs. (103), (133). q and -q give the same vector, except at the angle pi, where they
/// give opposite ones. |q| must be 1 within 1e-6.
Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);
/// Right Jacobian: Exp(theta + d) ~ Exp(theta) Exp(Jr(theta) d), eq. (143), and its inverse, eq. (144).
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& theta);
Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& theta);
/// The smallest rotation that turns `from` into the direction of `to`; about any axis across when they are opposite.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
/// Closest rotation to a 3x3 matrix in the Frobenius norm (SVD, det +1).
Eigen::Matrix3d project_to_so3(const Eigen::Matrix3d& m);

}  // namespace tutti
