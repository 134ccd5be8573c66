// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tutti {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Largest coordinate that readers of files and messages accept, so that squares and sums of many positions stay
/// finite.
inline constexpr double kMaxCoordinate_m = 1e9;

/// Rigid transform. T_a_b maps coordinates of b to a: p_a = T_a_b * p_b, and T_a_c = T_a_b * T_b_c.
/// Tangent order everywhere: [translation m; rotation rad], right perturbation in the frame b (docs/math.md).
struct Pose3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< Hamilton, unit norm.
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Pose3 inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {q, -(q * translation)};
  }
  [[nodiscard]] Eigen::Matrix4d matrix() const;
  static Pose3 from_matrix(const Eigen::Matrix4d& m);  ///< Rotation part is projected to SO(3).
};

/// Products are re-normalised, so long chains stay on the manifold.
Pose3 operator*(const Pose3& T_a_b, const Pose3& T_b_c);
Eigen::Vector3d operator*(const Pose3& T_a_b, const Eigen::Vector3d& p_b);
/// Equal coefficients, exactly: q and -q, though one rotation, are not equal.
bool operator==(const Pose3& a, const Pose3& b);

/// T (+) xi = (R Exp(theta), t + R rho): moves a pose by xi = [rho; theta] expressed in its own (right) frame.
Pose3 retract(const Pose3& T, const Vector6d& xi);
/// xi with retract(T, xi) == other: [R^T (t_other - t); Log(R^T R_other)]. This is also the residual of a relative pose
/// `local(T_meas, T_ij)` as g2o, GTSAM and SE-Sync files mean it (docs/math.md, "Geometry").
Vector6d local(const Pose3& T, const Pose3& other);
/// Adjoint in this tangent order: T Exp(xi) T^-1 = Exp(Ad(T) xi) to first order, so with T = T_a_b it takes a tangent
/// in b to one in a, and a covariance C in b to Ad C Ad^T in a.
Matrix6d adjoint(const Pose3& T);
/// Covariance of T_a_c = T_a_b * T_b_c for independent factors, first order, right tangent: Ad(T_b_c^-1) cov(T_a_b)
/// Ad(T_b_c^-1)^T + cov(T_b_c).
Matrix6d compound_covariance(const Pose3& T_b_c, const Matrix6d& cov_a_b, const Matrix6d& cov_b_c);

/// The pose at the share alpha in [0, 1] from a to b: straight in translation, shortest arc in rotation.
Pose3 interpolate(const Pose3& a, const Pose3& b, double alpha);
double rotation_angle(const Pose3& T);  ///< rad, in [0, pi].

/// Finite translation and quaternion of unit norm within `tolerance`.
bool is_valid(const Pose3& T, double tolerance = 1e-6);

}  // namespace tutti
