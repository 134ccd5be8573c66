// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/onboard_smoother.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "support/estimation/chain_mission.hpp"

namespace tutti::estimation {
namespace onboard_smoother_test {

using namespace testing;

TEST(OnboardSmoother, ComposesOdometryBeforeAnyConstraint) {
  Rng rng(1);
  const auto m = mission(rng, 100, 0);
  auto smoother = smoother_of(m);
  EXPECT_EQ(smoother.size(), 101U);
  const auto composed = smoother.poses();
  EXPECT_EQ(smoother.solve().termination, Termination::converged);
  EXPECT_LT(largest_position_difference(smoother.poses(), composed), 1e-12);
  EXPECT_EQ(smoother.pose(0), m.truth[0]);
}

TEST(OnboardSmoother, IsTheFullOptimum) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Rng rng(seed);
    const auto m = mission(rng, 3000, 40);
    auto plain = smoother_of(m);
    const double drift = largest_position_difference(plain.poses(), m.truth);
    ASSERT_EQ(plain.solve().termination, Termination::converged);
    auto polished = smoother_of(m, {.polishing_steps = 1});
    ASSERT_EQ(polished.solve().termination, Termination::converged);
    const auto optimum = full_optimum(m, plain.poses());
    EXPECT_LT(largest_position_difference(plain.poses(), optimum), 2e-3);
    EXPECT_LT(largest_position_difference(polished.poses(), optimum), 5e-5);
    EXPECT_LT(largest_rotation_difference(polished.poses(), optimum), 5e-5);
    EXPECT_LT(largest_position_difference(plain.poses(), m.truth), drift);
  }
}

TEST(OnboardSmoother, PolishingConvergesToTheFullOptimumUnderHeavyDrift) {
  Rng rng(7);
  const auto m = mission(rng, 1000, 15, 5e-3, 3e-3);
  auto smoother = smoother_of(m, {.relative_cost_tolerance = 1e-12, .polishing_steps = 6});
  ASSERT_EQ(smoother.solve().termination, Termination::converged);
  EXPECT_LT(largest_position_difference(smoother.poses(), full_optimum(m, smoother.poses())), 1e-5);
}

/// Wheel odometry: sure of its plane, and of the rest its covariance is large.
Mission planar_mission(Rng& rng, double unknown) {
  Mission out{.truth = {{}}, .odometry = {}, .constraints = {}};
  Vector6d sigma(0.007, 0.007, 0.0, 0.0, 0.0, 0.0012);
  for (int k = 0; k < 500; ++k) {
    Pose3 step{Eigen::Quaterniond(Eigen::AngleAxisd(1.0 / 60, Eigen::Vector3d::UnitZ())), {0.5, 0.0, 0.0}};
    const Vector6d noise = sigma.unaryExpr([&](double s) { return rng.normal(s); });
    Vector6d sway = Vector6d::Zero();
    sway[3] = 0.01 * std::cos(0.5 * k);
    out.truth.push_back(retract(out.truth.back() * step, sway));
    Matrix6d covariance = sigma.cwiseAbs2().asDiagonal();
    for (const int axis : {2, 3, 4}) covariance(axis, axis) = unknown;
    out.odometry.push_back({retract(step, noise), covariance});
  }
  const Matrix6d sure = Vector6d(1e-4, 1e-4, 1e-4, 2.5e-7, 2.5e-7, 2.5e-7).asDiagonal();
  for (std::size_t k = 0; k < 500; k += 50)
    out.constraints.push_back({k, k + 50, {out.truth[k].inverse() * out.truth[k + 50], sure}});
  return out;
}

TEST(OnboardSmoother, PolishingNeverMakesMattersWorse) {
  bool refused = false;
  for (const double unknown : {1e-4, 1.0, 9.0}) {
    Rng rng(3);
    const auto m = planar_mission(rng, unknown);
    auto plain = smoother_of(m);
    ASSERT_EQ(plain.solve().termination, Termination::converged);
    auto polished = smoother_of(m, {.polishing_steps = 3});
    const auto summary = polished.solve();
    ASSERT_EQ(summary.termination, Termination::converged);
    const double unpolished_m = largest_position_difference(plain.poses(), m.truth);
    EXPECT_LT(largest_position_difference(polished.poses(), m.truth), 1.1 * unpolished_m + 0.01) << unknown;
    refused = refused || summary.polishing_steps < 3;
  }
  EXPECT_TRUE(refused);
}

/// A constraint that contradicts the odometry by 30 sigmas of both is weighed by its covariance, not released.
RC_GTEST_PROP(OnboardSmoother, ConstraintsHoldAgainstOdometry, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  auto m = mission(rng, 200, 3);
  RelativePose odometry{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  for (std::size_t k = 30; k < 150; ++k) odometry = compound(odometry, m.odometry[k]);
  const Matrix6d covariance = std::pow(10.0, rng.uniform(-4.0, 1.0)) * odometry.covariance;
  const Vector6d off = (odometry.covariance + covariance).llt().matrixL() * random_tangent(rng, 1.0, 1.0).normalized();
  m.constraints.push_back({30, 150, {retract(odometry.T_a_b, 30.0 * off), covariance}});
  auto smoother = smoother_of(m);
  RC_ASSERT(is_usable(smoother.solve().termination));
  RC_ASSERT(largest_position_difference(smoother.poses(), full_optimum(m, smoother.poses())) < 5e-3);
}

TEST(OnboardSmoother, TailFollowsTheLastConstrainedNode) {
  Rng rng(2);
  const auto m = mission(rng, 500, 10);
  auto smoother = smoother_of(m);
  smoother.solve();
  for (std::size_t k = 460; k < 500; ++k)
    EXPECT_LT(local(smoother.pose(k) * m.odometry[k].T_a_b, smoother.pose(k + 1)).norm(), 1e-12);
}

TEST(OnboardSmoother, FirstPoseMovesEverything) {
  Rng rng(4);
  const auto m = mission(rng, 300, 12);
  auto smoother = smoother_of(m);
  smoother.solve();
  const auto before = smoother.poses();
  const Pose3 moved = random_pose(rng, 20.0, 2.0);
  smoother.set_first_pose(moved);
  const Pose3 motion = moved * before.front().inverse();
  std::vector<Pose3> expected;
  for (const Pose3& pose : before) expected.push_back(motion * pose);
  EXPECT_LT(largest_position_difference(smoother.poses(), expected), 1e-9);
  smoother.solve();
  EXPECT_LT(largest_position_difference(smoother.poses(), expected), 1e-6);
}

TEST(OnboardSmoother, BadNumbersLeaveThePosesAlone) {
  Rng rng(6);
  auto m = mission(rng, 100, 5);
  m.constraints.push_back({3, 70, {}});
  m.constraints.back().measurement.T_a_b.translation.x() = std::numeric_limits<double>::quiet_NaN();
  auto smoother = smoother_of(m);
  const auto before = smoother.poses();
  EXPECT_EQ(smoother.solve().termination, Termination::invalid_input);
  EXPECT_EQ(smoother.poses(), before);
  m.constraints.pop_back();
  m.constraints.push_back({3, 3, {}});  // from == to measures nothing
  smoother.set_constraints(m.constraints);
  EXPECT_EQ(smoother.solve().termination, Termination::converged);
  EXPECT_THROW(smoother.set_constraints({{0, 101, {}}}), std::logic_error);
}

}  // namespace onboard_smoother_test
}  // namespace tutti::estimation
