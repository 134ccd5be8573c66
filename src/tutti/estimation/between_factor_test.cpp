// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/between_factor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/estimation/random_graphs.hpp"

namespace tutti::estimation {
namespace between_factor_test {

using testing::random_pose;
using testing::random_tangent;

/// Central differences of the residual by the pose `which` (0: i, 1: j).
Matrix6d numeric_jacobian(const Pose3& T_i, const Pose3& T_j, const Pose3& meas, int which) {
  constexpr double kStep = 1e-6;
  Matrix6d J;
  for (int k = 0; k < 6; ++k) {
    const Vector6d xi = kStep * Vector6d::Unit(k);
    const auto at = [&](const Vector6d& move) {
      return between_residual(which == 0 ? retract(T_i, move) : T_i, which == 1 ? retract(T_j, move) : T_j, meas);
    };
    J.col(k) = (at(xi) - at(-xi)) / (2.0 * kStep);
  }
  return J;
}

TEST(BetweenFactor, IsZeroAtTruth) {
  Rng rng(1);
  for (int k = 0; k < 100; ++k) {
    const Pose3 T_i = random_pose(rng);
    const Pose3 meas = random_pose(rng);
    EXPECT_LT(between_residual(T_i, T_i * meas, meas).norm(), 1e-13);
  }
}

TEST(BetweenFactor, IsTheTangentOfTheMeasurementThatFits) {
  Rng rng(2);
  for (int k = 0; k < 100; ++k) {
    const Pose3 T_i = random_pose(rng);
    const Pose3 meas = random_pose(rng);
    const Vector6d xi = random_tangent(rng, 0.3, 0.4);
    EXPECT_LT((between_residual(T_i, T_i * retract(meas, xi), meas) - xi).norm(), 1e-12);
  }
}

TEST(BetweenFactor, HasTheSignOfAHandMadeOffset) {
  const Pose3 turned{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {1.0, 2.0, 3.0}};
  Pose3 further = turned;
  further.translation.x() += 0.1;  // along x of frame i; seen in the measurement's frame, turned by -0.5
  const Vector6d r = between_residual(Pose3{}, further, turned);
  EXPECT_NEAR(r[0], 0.1 * std::cos(0.5), 1e-15);
  EXPECT_NEAR(r[1], -0.1 * std::sin(0.5), 1e-15);
  EXPECT_NEAR(r.tail<4>().norm(), 0.0, 1e-15);
}

TEST(BetweenFactor, JacobiansAreThoseOfCentralDifferences) {
  Rng rng(3);
  for (const double error_rad : {0.0, 1e-9, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 1.7}) {
    for (int k = 0; k < 20; ++k) {
      const Pose3 T_i = random_pose(rng);
      const Pose3 meas = random_pose(rng);
      Vector6d error = random_tangent(rng, 0.5, 1.0);
      error.tail<3>() *= error_rad / error.tail<3>().norm();
      const Pose3 T_j = T_i * retract(meas, error);
      const auto factor = linearise_between(T_i, T_j, meas);
      EXPECT_LT((factor.residual - between_residual(T_i, T_j, meas)).norm(), 1e-13)
          << "linearise and residual disagree";
      EXPECT_LT((factor.J_i - numeric_jacobian(T_i, T_j, meas, 0)).norm(), 2e-8) << error_rad;
      EXPECT_LT((factor.J_j - numeric_jacobian(T_i, T_j, meas, 1)).norm(), 2e-8) << error_rad;
      EXPECT_LT((factor.J_i + factor.J_j * adjoint(T_j.inverse() * T_i)).norm(), 1e-12) << "common motion";
    }
  }
}

}  // namespace between_factor_test
}  // namespace tutti::estimation
