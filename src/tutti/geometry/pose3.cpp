// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/pose3.hpp"

#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti {

Eigen::Matrix4d Pose3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Pose3 Pose3::from_matrix(const Eigen::Matrix4d& m) {
  return {Eigen::Quaterniond(project_to_so3(m.topLeftCorner<3, 3>())).normalized(), m.topRightCorner<3, 1>()};
}

Pose3 operator*(const Pose3& T_a_b, const Pose3& T_b_c) {
  return {(T_a_b.rotation * T_b_c.rotation).normalized(), T_a_b.rotation * T_b_c.translation + T_a_b.translation};
}

Eigen::Vector3d operator*(const Pose3& T_a_b, const Eigen::Vector3d& p_b) {
  return T_a_b.rotation * p_b + T_a_b.translation;
}

bool operator==(const Pose3& a, const Pose3& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

Pose3 retract(const Pose3& T, const Vector6d& xi) {
  return {(T.rotation * so3_exp(xi.tail<3>())).normalized(), T.translation + T.rotation * xi.head<3>()};
}

Vector6d local(const Pose3& T, const Pose3& other) {
  const Eigen::Quaterniond inverse = T.rotation.conjugate();
  Vector6d xi;
  xi.head<3>() = inverse * (other.translation - T.translation);
  xi.tail<3>() = so3_log(inverse * other.rotation);
  return xi;
}

Matrix6d adjoint(const Pose3& T) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = R;
  ad.bottomRightCorner<3, 3>() = R;
  ad.topRightCorner<3, 3>() = skew(T.translation) * R;
  return ad;
}

Matrix6d compound_covariance(const Pose3& T_b_c, const Matrix6d& cov_a_b, const Matrix6d& cov_b_c) {
  const Matrix6d ad = adjoint(T_b_c.inverse());
  return ad * cov_a_b * ad.transpose() + cov_b_c;
}

Pose3 interpolate(const Pose3& a, const Pose3& b, double alpha) {
  return {a.rotation.slerp(alpha, b.rotation).normalized(), (1.0 - alpha) * a.translation + alpha * b.translation};
}

double rotation_angle(const Pose3& T) { return so3_log(T.rotation).norm(); }

bool is_valid(const Pose3& T, double tolerance) {
  return T.translation.allFinite() && T.rotation.coeffs().allFinite() && std::abs(T.rotation.norm() - 1.0) <= tolerance;
}

}  // namespace tutti
