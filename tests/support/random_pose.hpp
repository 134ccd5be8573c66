// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <iomanip>
#include <numbers>

#include "tutti/base/random.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/geometry/so3.hpp"

/// Random geometry for property tests, and comparisons that print both sides and the difference.
namespace tutti::test {

inline Eigen::Vector3d random_vector(Rng& rng, double sigma = 1.0) {
  return {rng.normal(sigma), rng.normal(sigma), rng.normal(sigma)};
}

inline Eigen::Vector3d random_direction(Rng& rng) { return random_vector(rng).normalized(); }

/// Any axis, angle uniform in [0, max_angle].
inline Eigen::Quaterniond random_rotation(Rng& rng, double max_angle = std::numbers::pi) {
  const Eigen::Vector3d axis = random_direction(rng);
  return so3_exp(rng.uniform(0.0, max_angle) * axis);
}

inline Pose3 random_pose(Rng& rng, double sigma_m = 10.0) {
  const Eigen::Quaterniond rotation = random_rotation(rng);
  return {rotation, random_vector(rng, sigma_m)};
}

inline Vector6d random_tangent(Rng& rng, double sigma = 1.0) {
  Vector6d xi;
  for (double& x : xi) x = rng.normal(sigma);
  return xi;
}

inline Vector6d draw(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d xi;
  for (int i = 0; i < 3; ++i) {
    xi(i) = rng.normal(sigma_m);
    xi(i + 3) = rng.normal(sigma_rad);
  }
  return xi;
}

/// Symmetric positive definite with full off-diagonal blocks, eigenvalues around sigma^2.
inline Matrix6d random_covariance(Rng& rng, double sigma = 1.0) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i) = rng.normal(sigma);
  return root * root.transpose() / 6.0 + 0.1 * sigma * sigma * Matrix6d::Identity();
}

template <class A, class B>
::testing::AssertionResult matrix_near(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b, double tolerance) {
  const double worst = (a - b).cwiseAbs().maxCoeff();
  if (worst <= tolerance) return ::testing::AssertionSuccess();  // NaN fails
  return ::testing::AssertionFailure() << std::setprecision(17) << "\n"
                                       << a << "\nand\n"
                                       << b << "\ndiffer by " << worst << " > " << tolerance;
}

inline ::testing::AssertionResult pose_near(const Pose3& a, const Pose3& b, double tolerance) {
  return matrix_near(a.matrix(), b.matrix(), tolerance);
}

}  // namespace tutti::test
