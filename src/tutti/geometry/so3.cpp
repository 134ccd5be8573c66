// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/so3.hpp"

#include <Eigen/SVD>
#include <cmath>

namespace tutti {
namespace {
// Below these angles (rad) the closed forms cancel; the first term the series leave out is below 1e-16 of the result.
// Measured against long double on both sides (so3_test.cpp): Exp, Log and both Jacobians to 1e-15.
constexpr double kSmallAngle = 1e-4;
constexpr double kSmallAngleJacobian = 1e-3;
}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  double w = 0.0;
  double k = 0.0;  // sin(angle / 2) / angle
  if (angle < kSmallAngle) {
    w = 1.0 - angle2 / 8.0;
    k = 0.5 - angle2 / 48.0;
  } else {
    w = std::cos(0.5 * angle);
    k = std::sin(0.5 * angle) / angle;
  }
  return Eigen::Quaterniond(w, k * theta.x(), k * theta.y(), k * theta.z()).normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // the smaller angle
  const Eigen::Vector3d v = sign * q.vec();
  const double w = sign * q.w();
  const double n = v.norm();
  if (n < 0.5 * kSmallAngle) return (2.0 / w - 2.0 * n * n / (3.0 * w * w * w)) * v;
  return (2.0 * std::atan2(n, w) / n) * v;
}

Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d w = skew(theta);
  double a = 0.5 - angle2 / 24.0;         // (1 - cos) / angle^2
  double b = 1.0 / 6.0 - angle2 / 120.0;  // (angle - sin) / angle^3
  if (angle > kSmallAngleJacobian) {
    const double half = std::sin(0.5 * angle);
    a = 2.0 * half * half / angle2;  // 1 - cos(angle) would lose half of the digits
    b = (angle - std::sin(angle)) / (angle2 * angle);
  }
  return Eigen::Matrix3d::Identity() - a * w + b * w * w;
}

Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d w = skew(theta);
  double c = 1.0 / 12.0 + angle2 / 720.0;  // 1/angle^2 - (1 + cos) / (2 angle sin)
  if (angle > kSmallAngleJacobian) c = 1.0 / angle2 - 0.5 / (angle * std::tan(0.5 * angle));
  return Eigen::Matrix3d::Identity() + 0.5 * w + c * w * w;
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Matrix3d project_to_so3(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d d(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  return svd.matrixU() * d.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace tutti
