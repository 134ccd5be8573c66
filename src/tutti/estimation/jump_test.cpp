// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/jump.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tutti/estimation/testing/random_graphs.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace {

using namespace testing;

/// A body that walks: 5 cm a step, swaying and turning smoothly; odometry with its noise.
struct Walk {
  std::vector<Pose3> truth{Pose3{}};
  std::vector<Pose3> motion;  ///< True, of every step.
  std::vector<RelativePose> odometry;
  explicit Walk(Rng& rng, std::size_t steps) {
    Vector6d variances;
    variances << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(4e-8);
    const Matrix6d covariance = variances.asDiagonal();
    const double phase = rng.uniform(0.0, 6.0);
    for (std::size_t k = 0; k < steps; ++k) {
      const double t = 0.1 * static_cast<double>(k) + phase;
      motion.emplace_back(so3_exp({0.003 * std::sin(3.0 * t), 0.002 * std::cos(2.0 * t), 0.01 * std::sin(0.4 * t)}),
                          Eigen::Vector3d(0.05 + 0.01 * std::sin(2.0 * t), 0.004 * std::cos(3.0 * t), 0.0));
      truth.push_back(truth.back() * motion.back());
      odometry.push_back({retract(motion.back(), sample(rng, covariance)), covariance});
    }
  }
  [[nodiscard]] Pose3 between(std::size_t a, std::size_t b) const { return truth[a].inverse() * truth[b]; }
  /// The same, seen that well.
  [[nodiscard]] RelativePose seen(std::size_t a, std::size_t b, double sigma = 1e-4) const {
    return {between(a, b), sigma * sigma * Matrix6d::Identity()};
  }
  void slip(std::size_t step, const Pose3& by) { odometry[step].T_a_b = odometry[step].T_a_b * by; }
};

Pose3 turn(double degrees) { return {so3_exp({0.0, 0.0, degrees * kRadPerDeg}), Eigen::Vector3d::Zero()}; }

RC_GTEST_PROP(FindJump, FindsTheStepThatSlipped, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Walk walk(rng, 200);
  const std::size_t step = 50 + rng.index(100);
  const double size = rng.bernoulli(0.5) ? 1.0 : -1.0;
  walk.slip(step, rng.bernoulli(0.5) ? turn(size * rng.uniform(3.0, 40.0))
                                     : Pose3{Eigen::Quaterniond::Identity(), {0.0, size * rng.uniform(0.1, 1.0), 0.0}});
  RelativePose seen = walk.seen(50, 150, 1e-3);
  seen.T_a_b = retract(seen.T_a_b, sample(rng, seen.covariance));
  const auto jump = find_jump(walk.odometry, 50, 150, seen);
  RC_ASSERT(jump.has_value());
  RC_ASSERT(jump->step == step);
  const Vector6d off = local(walk.between(step, step + 1), jump->motion.T_a_b);
  RC_ASSERT(off.head<3>().norm() < 0.02 && off.tail<3>().norm() < 0.02);
}

// What odometry's noise allows for is nobody's fault.
RC_GTEST_PROP(FindJump, LeavesOrdinaryDriftAlone, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Walk walk(rng, 200);
  RC_ASSERT(!find_jump(walk.odometry, 20, 180, walk.seen(20, 180)).has_value());
}

// Wrong by as much, but a little at every step of a stretch: no step is to blame.
RC_GTEST_PROP(FindJump, LeavesASlideAlone, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Walk walk(rng, 200);
  const auto length = 20 + rng.index(60);
  for (std::size_t k = 60; k < 60 + length; ++k)
    walk.slip(k, Pose3{so3_exp({0.0, 0.0, 20.0 * kRadPerDeg / static_cast<double>(length)}),
                       {1.0 / static_cast<double>(length), 0.0, 0.0}});
  RC_ASSERT(!find_jump(walk.odometry, 20, 180, walk.seen(20, 180)).has_value());
}

// Keyframes: a jump is one at once, so its step is a short one.
TEST(FindJump, GuessesByHowLongAStepTook) {
  Rng rng(7);
  const Walk walk(rng, 400);
  std::vector<RelativePose> steps;
  std::vector<double> duration_s;
  std::vector<std::size_t> at{0};
  for (std::size_t k = 0; at.back() < 400; ++k) {
    const std::size_t samples = k == 40 ? 1 : 4;
    RelativePose step{.T_a_b = {}, .covariance = Matrix6d::Zero()};
    for (std::size_t i = at.back(); i < std::min<std::size_t>(at.back() + samples, 400); ++i)
      step = compound(step, walk.odometry[i]);
    steps.push_back(step);
    duration_s.push_back(0.1 * static_cast<double>(samples));
    at.push_back(std::min<std::size_t>(at.back() + samples, 400));
  }
  steps[40].T_a_b = steps[40].T_a_b * turn(20.0);
  const auto jump = find_jump(steps, 10, 80, walk.seen(at[10], at[80]), duration_s);
  ASSERT_TRUE(jump.has_value());
  EXPECT_EQ(jump->step, 40U);
  EXPECT_LT(local(walk.between(at[40], at[41]), jump->motion.T_a_b).norm(), 0.02);
}

// Where nobody knows better than odometry, it may have jumped or not.
TEST(FindJump, LeavesAJumpAloneThatIsHardlySeen) {
  Rng rng(6);
  Walk walk(rng, 200);
  walk.slip(90, turn(10.0));
  EXPECT_TRUE(find_jump(walk.odometry, 20, 180, walk.seen(20, 180)).has_value());
  EXPECT_FALSE(find_jump(walk.odometry, 20, 180, walk.seen(20, 180, 1.0)).has_value());
}

// A gait of several degrees at every step is how this body moves; a jump is judged beside it.
RC_GTEST_PROP(FindJump, SeesASlipInAnUnsteadyGait, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Walk walk(rng, 200);
  const double phase = rng.uniform(0.0, 6.0);
  for (std::size_t k = 0; k < 200; ++k) {
    const Pose3 sway{so3_exp(1.5 * kRadPerDeg *
                             Eigen::Vector3d(std::sin(2.6 * static_cast<double>(k) + phase),
                                             std::cos(2.6 * static_cast<double>(k)), 0.0)),
                     Eigen::Vector3d::Zero()};
    walk.odometry[k].T_a_b = walk.odometry[k].T_a_b * sway;
    walk.truth[k + 1] = walk.truth[k] * (walk.motion[k] * sway);
  }
  RC_ASSERT(!find_jump(walk.odometry, 50, 150, walk.seen(50, 150)).has_value());
  const std::size_t step = 70 + rng.index(60);
  walk.slip(step, turn(rng.uniform(4.0, 20.0)));
  const auto jump = find_jump(walk.odometry, 50, 150, walk.seen(50, 150));
  RC_ASSERT(jump.has_value());
  RC_ASSERT(jump->step == step);
}

// A glitch that the next step takes back is not what the ends ask for.
TEST(FindJump, LeavesAGlitchAlone) {
  Rng rng(3);
  Walk walk(rng, 200);
  walk.slip(90, turn(20.0));
  walk.odometry[91].T_a_b = turn(-20.0) * walk.odometry[91].T_a_b;
  for (std::size_t k = 120; k < 160; ++k) walk.slip(k, turn(0.3));
  EXPECT_FALSE(find_jump(walk.odometry, 20, 180, walk.seen(20, 180)).has_value());
}

TEST(FindJump, AtTheEndsOfTheChainAndInShortOnes) {
  Rng rng(4);
  for (const std::size_t step : {0U, 99U}) {
    Walk walk(rng, 100);
    walk.slip(step, turn(15.0));
    const auto jump = find_jump(walk.odometry, 0, 100, walk.seen(0, 100));
    ASSERT_TRUE(jump.has_value());
    EXPECT_EQ(jump->step, step);
  }
  for (const std::size_t steps : {1U, 2U}) {
    Walk walk(rng, steps);
    walk.slip(0, turn(15.0));
    EXPECT_FALSE(find_jump(walk.odometry, 0, steps, walk.seen(0, steps)).has_value());
  }
}

}  // namespace
}  // namespace tutti::estimation
