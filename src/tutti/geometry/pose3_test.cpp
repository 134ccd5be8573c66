// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/pose3.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support/random_pose.hpp"

namespace tutti {
namespace pose3_test {

using test::matrix_near;
using test::pose_near;
using test::random_pose;
constexpr double kPi = std::numbers::pi;

RC_GTEST_PROP(Pose3, IsAGroup, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 a = random_pose(rng);
  const Pose3 b = random_pose(rng);
  const Pose3 c = random_pose(rng);
  RC_ASSERT(pose_near((a * b) * c, a * (b * c), 1e-13));
  RC_ASSERT(pose_near(a * a.inverse(), Pose3{}, 1e-13));
  RC_ASSERT(pose_near(a.inverse() * a, Pose3{}, 1e-13));
  RC_ASSERT(pose_near(a * Pose3{}, a, 1e-14));
}

RC_GTEST_PROP(Pose3, ActsLikeItsMatrix, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 a = random_pose(rng);
  const Pose3 b = random_pose(rng);
  const Eigen::Vector3d p = test::random_vector(rng, 10.0);
  RC_ASSERT(matrix_near((a * b).matrix(), a.matrix() * b.matrix(), 1e-13));
  RC_ASSERT(matrix_near(a * p, (a.matrix() * p.homogeneous()).head<3>(), 1e-13));
  RC_ASSERT(pose_near(Pose3::from_matrix(a.matrix()), a, 1e-13));
}

TEST(Pose3, LongChainsStayOnTheManifold) {
  Rng rng(1);
  Pose3 T;
  for (int i = 0; i < 100'000; ++i) T = T * Pose3{test::random_rotation(rng, 0.1), Eigen::Vector3d::Zero()};
  EXPECT_NEAR(T.rotation.norm(), 1.0, 1e-15);
}

RC_GTEST_PROP(Pose3, LocalUndoesRetract, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T = random_pose(rng);
  for (const double angle : {0.0, 1e-8, 1e-4, 1e-3, 1.0, kPi - 1e-6}) {
    Vector6d xi;
    xi << test::random_vector(rng, 10.0), angle * test::random_direction(rng);
    RC_ASSERT(matrix_near(local(T, retract(T, xi)), xi, 1e-13));
  }
  const Pose3 other = random_pose(rng);
  RC_ASSERT(pose_near(retract(T, local(T, other)), other, 1e-13));
}

// The residual of a relative pose as g2o, GTSAM and SE-Sync files mean it, with a hand-made offset: the measurement
// turns its x axis to y, so an error along the parent's y is one along the measurement's x.
TEST(Pose3, ResidualIsExpressedInTheMeasuredFrameTranslationFirst) {
  const Pose3 T_meas{so3_exp({0.0, 0.0, kPi / 2.0}), {1.0, 2.0, 3.0}};
  const Pose3 T_ij{T_meas.rotation * so3_exp({0.0, 0.02, 0.0}), {1.0, 2.1, 3.0}};
  Vector6d expected;
  expected << 0.1, 0.0, 0.0, 0.0, 0.02, 0.0;
  EXPECT_TRUE(matrix_near(local(T_meas, T_ij), expected, 1e-15));
}

RC_GTEST_PROP(Pose3, RetractIsARightPerturbation, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T = random_pose(rng);
  const Pose3 left = random_pose(rng);
  const Vector6d xi = test::random_tangent(rng);
  RC_ASSERT(pose_near(retract(T, xi), T * retract(Pose3{}, xi), 1e-13));
  RC_ASSERT(pose_near(retract(left * T, xi), left * retract(T, xi), 1e-12));  // the world frame does not matter
}

RC_GTEST_PROP(Pose3, AdjointMovesTangentsAcross, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T = random_pose(rng, 3.0);
  const Pose3 U = random_pose(rng, 3.0);
  const Vector6d xi = test::random_tangent(rng);
  // T Exp(h xi) T^-1 = Exp(h Ad xi + O(h^2)): the error falls with h squared, so the difference quotient with h.
  const double h = 1e-6;
  const auto moved = [&](double s) -> Vector6d { return local(Pose3{}, T * retract(Pose3{}, s * xi) * T.inverse()); };
  RC_ASSERT(matrix_near((moved(h) - moved(-h)) / (2.0 * h), adjoint(T) * xi, 1e-7));
  RC_ASSERT(matrix_near(adjoint(T * U), adjoint(T) * adjoint(U), 1e-12));
  RC_ASSERT(matrix_near(adjoint(T.inverse()) * adjoint(T), Matrix6d::Identity(), 1e-12));
}

RC_GTEST_PROP(Pose3, CompoundCovarianceMatchesNumericPropagation, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T_a_b = random_pose(rng, 3.0);
  const Pose3 T_b_c = random_pose(rng, 3.0);
  const Matrix6d cov_a_b = test::random_covariance(rng);
  const Matrix6d cov_b_c = test::random_covariance(rng);
  const double h = 1e-6;
  Eigen::Matrix<double, 6, 12> jacobian;
  for (int k = 0; k < 12; ++k) {
    const auto perturbed = [&](double s) -> Vector6d {
      Eigen::Matrix<double, 12, 1> xi = s * Eigen::Matrix<double, 12, 1>::Unit(k);
      return local(T_a_b * T_b_c, retract(T_a_b, xi.head<6>()) * retract(T_b_c, xi.tail<6>()));
    };
    jacobian.col(k) = (perturbed(h) - perturbed(-h)) / (2.0 * h);
  }
  const Matrix6d expected = jacobian.leftCols<6>() * cov_a_b * jacobian.leftCols<6>().transpose() +
                            jacobian.rightCols<6>() * cov_b_c * jacobian.rightCols<6>().transpose();
  const Matrix6d actual = compound_covariance(T_b_c, cov_a_b, cov_b_c);
  RC_ASSERT(matrix_near(actual, expected, 1e-6 * expected.norm()));
}

TEST(Pose3, CompoundCovarianceMatchesMonteCarlo) {
  Rng rng(8);
  const Pose3 T_a_b = random_pose(rng, 3.0);
  const Pose3 T_b_c = random_pose(rng, 3.0);
  const Matrix6d cov_a_b = test::random_covariance(rng, 0.01);
  const Matrix6d cov_b_c = test::random_covariance(rng, 0.01);
  const Matrix6d root_a_b = cov_a_b.llt().matrixL();
  const Matrix6d root_b_c = cov_b_c.llt().matrixL();
  const int n = 20'000;
  Matrix6d sampled = Matrix6d::Zero();
  for (int i = 0; i < n; ++i) {
    const Vector6d xi_a_b = root_a_b * test::random_tangent(rng);
    const Vector6d xi_b_c = root_b_c * test::random_tangent(rng);
    const Vector6d xi = local(T_a_b * T_b_c, retract(T_a_b, xi_a_b) * retract(T_b_c, xi_b_c));
    sampled += xi * xi.transpose() / n;
  }
  const Matrix6d expected = compound_covariance(T_b_c, cov_a_b, cov_b_c);
  // A sampled entry scatters by sqrt((c_ii c_jj + c_ij^2) / n) <= sqrt(2 c_ii c_jj / n).
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(sampled(i, j), expected(i, j), 5.0 * std::sqrt(2.0 * expected(i, i) * expected(j, j) / n));
}

RC_GTEST_PROP(Pose3, InterpolationMovesEvenlyAlongTheShortestArc, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 a = random_pose(rng);
  Pose3 b = random_pose(rng);
  if (seed % 2 == 0) b.rotation.coeffs() *= -1.0;  // the same rotation, the other quaternion
  RC_ASSERT(pose_near(interpolate(a, b, 0.0), a, 1e-14));
  RC_ASSERT(pose_near(interpolate(a, b, 1.0), b, 1e-13));
  const double whole = rotation_angle(a.inverse() * b);
  RC_PRE(whole < kPi - 1e-3);  // at pi both directions are shortest
  for (const double alpha : {0.25, 0.5, 0.9}) {
    const Pose3 between = interpolate(a, b, alpha);
    RC_ASSERT(std::abs(rotation_angle(a.inverse() * between) - alpha * whole) < 1e-9);
    RC_ASSERT(matrix_near(between.translation, a.translation + alpha * (b.translation - a.translation), 1e-13));
  }
}

TEST(Pose3, InterpolationOfEqualAndAlmostEqualPoses) {
  Rng rng(9);
  const Pose3 a = random_pose(rng);
  for (const double angle : {0.0, 1e-15, 1e-9, 1e-7}) {
    const Pose3 b = retract(a, (Vector6d() << 0.0, 0.0, 0.0, angle, 0.0, 0.0).finished());
    const Pose3 expected = retract(a, (Vector6d() << 0.0, 0.0, 0.0, 0.5 * angle, 0.0, 0.0).finished());
    EXPECT_TRUE(pose_near(interpolate(a, b, 0.5), expected, 1e-15)) << angle;
  }
}

TEST(Pose3, RotationAngleIsBetweenZeroAndPi) {
  for (const double angle : {0.0, 1e-9, 1.0, kPi - 1e-9})
    EXPECT_NEAR(rotation_angle({so3_exp({0.0, -angle, 0.0}), {5.0, 0.0, 0.0}}), angle, 1e-15);
  EXPECT_NEAR(rotation_angle({so3_exp({0.0, 0.0, kPi + 0.5}), {}}), kPi - 0.5, 1e-15);
}

TEST(Pose3, ValidMeansFiniteAndOfUnitNorm) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_valid(Pose3{}));
  EXPECT_TRUE(is_valid({Eigen::Quaterniond(1.0 + 5e-7, 0.0, 0.0, 0.0), {}}));
  EXPECT_FALSE(is_valid({Eigen::Quaterniond(1.0 + 5e-6, 0.0, 0.0, 0.0), {}}));
  EXPECT_TRUE(is_valid({Eigen::Quaterniond(1.0 + 5e-6, 0.0, 0.0, 0.0), {}}, 1e-5));
  EXPECT_FALSE(is_valid({Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0), {}}));
  EXPECT_FALSE(is_valid({Eigen::Quaterniond(nan, 0.0, 0.0, 0.0), {}}));
  EXPECT_FALSE(is_valid({Eigen::Quaterniond::Identity(), {0.0, inf, 0.0}}));
  EXPECT_FALSE(is_valid({Eigen::Quaterniond::Identity(), {0.0, 0.0, nan}}));
}

}  // namespace pose3_test
}  // namespace tutti
