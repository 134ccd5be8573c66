// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/onboard_smoother.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/estimation/testing/random_graphs.hpp"

namespace tutti::estimation {
namespace {

using namespace testing;

struct Mission {
  std::vector<Pose3> truth;
  std::vector<RelativePose> odometry;
  std::vector<ChainConstraint> constraints;
};

/// A long walk at 4 cm a step with correlated odometry noise, and constraints between some of its nodes.
Mission mission(Rng& rng, std::size_t steps, std::size_t constraints, double sigma_m = 1e-3, double sigma_rad = 3e-4) {
  Mission out{.truth = {random_pose(rng)}, .odometry = {}, .constraints = {}};
  for (std::size_t k = 0; k < steps; ++k) {
    Vector6d u;
    u << 0.04, 0.0, 0.0, rng.normal(0.002), rng.normal(0.002), rng.normal(0.01);
    const Matrix6d covariance = random_covariance(rng, sigma_m, sigma_rad);
    out.truth.push_back(retract(out.truth.back(), u));
    const Pose3 exact = out.truth[k].inverse() * out.truth[k + 1];
    out.odometry.push_back({retract(exact, sample(rng, covariance)), covariance});
  }
  for (std::size_t k = 0; k < constraints; ++k) {
    const auto a = static_cast<std::size_t>(rng.index(steps * 9 / 10));
    const auto b = static_cast<std::size_t>(rng.index(steps * 9 / 10));
    const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
    const Pose3 exact = out.truth[a].inverse() * out.truth[b];
    if (a != b) out.constraints.push_back({a, b, {retract(exact, sample(rng, covariance)), covariance}});
  }
  return out;
}

OnboardSmoother smoother_of(const Mission& mission, const OnboardSmootherConfig& config = {}) {
  OnboardSmoother smoother(config, mission.truth.front());
  for (const auto& step : mission.odometry) smoother.append(step);
  smoother.set_constraints(mission.constraints);
  return smoother;
}

std::vector<Pose3> full_optimum(const Mission& mission, const std::vector<Pose3>& start) {
  PoseGraph graph{.poses = start, .edges = {}};
  for (std::size_t k = 0; k < mission.odometry.size(); ++k)
    graph.edges.push_back({k, k + 1, mission.odometry[k].T_a_b, mission.odometry[k].covariance.inverse()});
  for (const auto& c : mission.constraints)
    graph.edges.push_back({c.from, c.to, c.measurement.T_a_b, c.measurement.covariance.inverse()});
  const auto solution = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-14, .initialisation = "given"});
  EXPECT_EQ(solution.summary.termination, Termination::converged);
  return solution.poses;
}

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

TEST(OnboardSmoother, TailFollowsTheLastConstrainedNode) {
  Rng rng(2);
  const auto m = mission(rng, 500, 10);
  auto smoother = smoother_of(m);
  smoother.solve();
  for (std::size_t k = 460; k < 500; ++k)
    EXPECT_LT(local(smoother.pose(k) * m.odometry[k].T_a_b, smoother.pose(k + 1)).norm(), 1e-12);
}

TEST(OnboardSmoother, EstimateIsAFunctionOfItsState) {
  Rng rng(3);
  const auto m = mission(rng, 800, 20);
  auto gradual = OnboardSmoother({}, m.truth.front());
  for (std::size_t k = 0; k < 800; ++k) {
    gradual.append(m.odometry[k]);
    if (k == 300 || k == 600) {
      std::vector<ChainConstraint> some;
      for (const auto& c : m.constraints)
        if (std::max(c.from, c.to) <= k) some.push_back(c);
      gradual.set_constraints(some);
      gradual.solve();
    }
  }
  gradual.set_constraints(m.constraints);
  gradual.solve();
  OnboardSmoother restored({}, gradual.state());
  restored.solve();
  EXPECT_EQ(gradual.poses(), restored.poses());
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

TEST(OnboardSmoother, RobustLossDistrustsAWrongConstraint) {
  Rng rng(5);
  auto m = mission(rng, 1000, 30);
  m.constraints.push_back({50, 800, {random_pose(rng, 3.0, 1.0), 1e-6 * Matrix6d::Identity()}});
  auto robust = smoother_of(m, {.loss = "cauchy"});
  ASSERT_TRUE(is_usable(robust.solve().termination));
  auto naive = smoother_of(m);
  naive.solve();
  EXPECT_LT(largest_position_difference(robust.poses(), m.truth),
            0.2 * largest_position_difference(naive.poses(), m.truth));
  EXPECT_LT(robust.constraint_weights().back(), 1e-3);
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
  m.constraints.push_back({3, 3, {}});  // from == to says nothing
  smoother.set_constraints(m.constraints);
  EXPECT_EQ(smoother.solve().termination, Termination::converged);
  EXPECT_THROW(smoother.set_constraints({{0, 101, {}}}), std::logic_error);
}

}  // namespace
}  // namespace tutti::estimation
