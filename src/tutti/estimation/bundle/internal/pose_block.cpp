// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/pose_block.hpp"

#include "tutti/geometry/so3.hpp"

namespace tutti::bundle::internal {

Pose3 pose_of(const double* block) {
  return {Eigen::Quaterniond(block[6], block[3], block[4], block[5]), {block[0], block[1], block[2]}};
}

void write_pose(const Pose3& pose, double* block) {
  Eigen::Map<Eigen::Vector3d>{block} = pose.translation;
  Eigen::Map<Eigen::Vector4d>{block + 3} = pose.rotation.coeffs();
}

PlusJacobian plus_jacobian(const double* x) {
  const Pose3 T = pose_of(x);
  PlusJacobian J = PlusJacobian::Zero();
  J.topLeftCorner<3, 3>() = T.rotation.toRotationMatrix();
  // q [theta / 2; 1] = [w u + v x u; -v u] for u = theta / 2
  J.block<3, 3>(3, 3) = 0.5 * (T.rotation.w() * Eigen::Matrix3d::Identity() + skew(T.rotation.vec()));
  J.block<1, 3>(6, 3) = -0.5 * T.rotation.vec().transpose();
  return J;
}

MinusJacobian minus_jacobian(const double* x) {
  const Pose3 T = pose_of(x);
  MinusJacobian J = MinusJacobian::Zero();
  J.topLeftCorner<3, 3>() = T.rotation.toRotationMatrix().transpose();
  J.block<3, 3>(3, 3) = 2.0 * (T.rotation.w() * Eigen::Matrix3d::Identity() - skew(T.rotation.vec()));
  J.block<3, 1>(3, 6) = -2.0 * T.rotation.vec();
  return J;
}

}  // namespace tutti::bundle::internal
