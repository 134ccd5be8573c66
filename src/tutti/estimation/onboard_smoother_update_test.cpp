// SPDX-License-Identifier: BSD-3-Clause
// One update after another: what is kept, what is done again, and that the history of calls does not show.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <utility>

#include "support/estimation/chain_mission.hpp"

namespace tutti::estimation {
namespace onboard_smoother_update_test {

using namespace testing;

ChainConstraint any_constraint(Rng& rng, const Mission& m, std::size_t nodes) {
  const auto a = static_cast<std::size_t>(rng.index(nodes));
  const auto b = static_cast<std::size_t>(rng.index(nodes));
  const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
  return {a, b, {retract(m.truth[a].inverse() * m.truth[b], sample(rng, covariance)), covariance}};
}

/// Appends, adds, withdraws, replaces and moves at random, and solves after each change.
OnboardSmoother live(Rng rng, const Mission& m, const OnboardSmootherConfig& config, int updates) {
  OnboardSmoother smoother(config, m.truth.front());
  std::vector<ChainConstraint> constraints;
  for (int update = 0; update < updates; ++update) {
    const std::size_t steps = m.odometry.size() * static_cast<std::size_t>(update + 1) / updates;
    while (smoother.size() <= steps) smoother.append(m.odometry[smoother.size() - 1]);
    for (std::size_t k = rng.index(4); k > 0; --k) constraints.push_back(any_constraint(rng, m, smoother.size()));
    if (!constraints.empty() && rng.bernoulli(0.4))
      constraints.erase(constraints.begin() + static_cast<std::ptrdiff_t>(rng.index(constraints.size())));
    if (!constraints.empty() && rng.bernoulli(0.4)) {
      auto& T = constraints[rng.index(constraints.size())].measurement.T_a_b;
      T = retract(T, random_tangent(rng, 2e-3, 1e-3));
    }
    if (rng.bernoulli(0.2)) smoother.set_first_pose(random_pose(rng, 20.0, 2.0));
    smoother.set_constraints(constraints);
    EXPECT_TRUE(is_usable(smoother.solve().termination));
  }
  return smoother;
}

/// Without the poses that the last solve left.
SmootherState bare(SmootherState state) {
  state.poses.clear();
  state.solution.clear();
  state.held = 0;
  return state;
}

RC_GTEST_PROP(OnboardSmootherUpdate, HistoryDoesNotShow, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const auto m = mission(rng, 300, 0);
  const OnboardSmootherConfig config{.polishing_steps = rng.bernoulli(0.2) ? 1 : 0};
  const auto smoother = live(rng.fork("updates"), m, config, 8);
  OnboardSmoother restored(config, bare(smoother.state()));
  restored.solve();
  RC_ASSERT(largest_position_difference(smoother.poses(), restored.poses()) < 1e-4);
  RC_ASSERT(largest_rotation_difference(smoother.poses(), restored.poses()) < 1e-4);
}

/// Two passes through a corridor, links arriving one by one: most of the reduced graph stays as it is each time.
TEST(OnboardSmootherUpdate, ManySmallBatchesAddUpToOneLarge) {
  Rng rng(4);
  const auto m = mission(rng, 1200, 0);
  auto smoother = smoother_of(m);
  std::vector<ChainConstraint> constraints;
  for (std::size_t k = 0; k < 150; ++k) {
    const std::size_t a = 4 * ((k * 37) % 150);
    const std::size_t b = 1200 - a - rng.index(4);
    const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
    constraints.push_back({a, b, {retract(m.truth[a].inverse() * m.truth[b], sample(rng, covariance)), covariance}});
    smoother.set_constraints(constraints);
    ASSERT_TRUE(is_usable(smoother.solve().termination));
  }
  OnboardSmoother restored({}, bare(smoother.state()));
  restored.solve();
  EXPECT_LT(largest_position_difference(smoother.poses(), restored.poses()), 2e-5);
}

RC_GTEST_PROP(OnboardSmootherUpdate, ARestoredOneGoesOnToTheBit, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const auto m = mission(rng, 300, 12);
  auto smoother = live(rng.fork("updates"), m, {.polishing_steps = 1}, 8);
  OnboardSmoother restored({.polishing_steps = 1}, smoother.state());
  RC_ASSERT(restored.state() == smoother.state());
  for (OnboardSmoother* one : {&smoother, &restored}) {
    one->append(m.odometry.front());
    one->set_constraints(m.constraints);
    one->solve();
  }
  RC_ASSERT(restored.state() == smoother.state());
}

/// A stored smoother has poses only where they do not follow from the rest.
RC_GTEST_PROP(OnboardSmootherUpdate, ItsPosesFollowToTheBitFromTheSolution, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const auto m = mission(rng, 300, 12);
  const OnboardSmootherConfig config{.polishing_steps = rng.bernoulli(0.8) ? 1 : 0};
  auto smoother = live(rng.fork("updates"), m, config, 8);
  RC_ASSERT(smoother.state().held == 0U);
  if (rng.bernoulli(0.5)) smoother.append(m.odometry.front());
  if (rng.bernoulli(0.3)) smoother.set_first_pose(random_pose(rng, 20.0, 2.0));
  if (rng.bernoulli(0.3)) smoother.set_constraints(m.constraints);
  if (rng.bernoulli(0.5)) smoother.append(m.odometry.front());
  SmootherState stored = smoother.state();
  stored.poses = stored.poses.part(0, stored.held);
  const OnboardSmoother restored(config, stored);
  RC_ASSERT(restored.state() == smoother.state());
}

TEST(OnboardSmootherUpdate, SameCallsSameBits) {
  Rng rng(2);
  const auto m = mission(rng, 500, 0);
  EXPECT_EQ(live(Rng(3), m, {}, 10).poses(), live(Rng(3), m, {}, 10).poses());
}

RC_GTEST_PROP(OnboardSmootherUpdate, TheOrderOfConstraintsDoesNotMatter, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  auto m = mission(rng, 300, 25);
  const OnboardSmootherConfig config{.polishing_steps = rng.bernoulli(0.5) ? 1 : 0};
  auto ordered = smoother_of(m, config);
  for (std::size_t k = m.constraints.size(); k > 1; --k) std::swap(m.constraints[k - 1], m.constraints[rng.index(k)]);
  auto shuffled = smoother_of(m, config);
  RC_ASSERT(is_usable(ordered.solve().termination));
  RC_ASSERT(is_usable(shuffled.solve().termination));
  RC_ASSERT(largest_position_difference(ordered.poses(), shuffled.poses()) < 1e-6);
}

TEST(OnboardSmootherUpdate, CompoundsOnlyWhatChanged) {
  Rng rng(5);
  auto m = mission(rng, 4000, 0);
  const auto link = [&](std::size_t a, std::size_t b) {
    const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
    m.constraints.push_back({a, b, {retract(m.truth[a].inverse() * m.truth[b], sample(rng, covariance)), covariance}});
  };
  for (std::size_t k = 0; k < 3600; k += 100) link(k, k + 100);
  auto smoother = smoother_of(m);
  EXPECT_EQ(smoother.solve().compounded_steps, 3600U);
  const auto again = smoother.solve();
  EXPECT_EQ(again.compounded_steps, 0U);
  EXPECT_EQ(again.iterations, 1);
  auto& T = m.constraints[17].measurement.T_a_b;
  T = retract(T, random_tangent(rng, 2e-3, 1e-3));
  smoother.set_constraints(m.constraints);
  EXPECT_EQ(smoother.solve().compounded_steps, 0U);
  link(1010, 1950);  // splits two runs
  smoother.set_constraints(m.constraints);
  EXPECT_EQ(smoother.solve().compounded_steps, 200U);
}

/// A robot drives on for months: what is kept is bounded by the constraints that stand now.
TEST(OnboardSmootherUpdate, NothingGrowsWithTheNumberOfUpdates) {
  Rng rng(6);
  const auto m = mission(rng, 800, 0);
  auto smoother = smoother_of(m);
  for (int update = 0; update < 200; ++update) {
    std::vector<ChainConstraint> constraints;
    for (std::size_t k = rng.index(12); k > 0; --k) constraints.push_back(any_constraint(rng, m, smoother.size()));
    smoother.set_constraints(constraints);
    const auto summary = smoother.solve();
    ASSERT_TRUE(is_usable(summary.termination));
    EXPECT_LE(summary.reduced_nodes, 2 * constraints.size() + 1);
    EXPECT_LE(summary.reduced_edges, summary.reduced_nodes - 1 + constraints.size());
  }
  EXPECT_EQ(smoother.state().odometry.size(), 800U);
  EXPECT_EQ(smoother.poses().size(), 801U);
  smoother.set_constraints({});
  EXPECT_EQ(smoother.solve().reduced_nodes, 1U);
}

/// From a map bent by nonsense, withdrawing it must lead back to where a fresh start leads.
TEST(OnboardSmootherUpdate, ForgetsWhatWasWithdrawn) {
  Rng rng(7);
  auto m = mission(rng, 600, 8);
  auto smoother = smoother_of(m);
  auto nonsense = m.constraints;
  nonsense.push_back({50, 500, {random_pose(rng, 30.0, 2.5), 1e-8 * Matrix6d::Identity()}});
  smoother.set_constraints(nonsense);
  smoother.solve();
  smoother.set_constraints(m.constraints);
  smoother.solve();
  OnboardSmoother restored({}, bare(smoother.state()));
  restored.solve();
  EXPECT_LT(largest_position_difference(smoother.poses(), restored.poses()), 1e-4);
}

}  // namespace onboard_smoother_update_test
}  // namespace tutti::estimation
