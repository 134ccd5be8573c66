// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/ate.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <numbers>

#include "tutti/base/random.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace ate_test {

const std::vector<Eigen::Vector3d> kSquare = {{1, 1, 0}, {1, -1, 0}, {-1, 1, 0}, {-1, -1, 0}};

Pose3 at(const Eigen::Vector3d& position) { return {Eigen::Quaterniond::Identity(), position}; }

/// Draws in general position: RapidCheck gives the seed.
struct Draw {
  Rng rng{*rc::gen::arbitrary<std::uint64_t>()};
  Eigen::Vector3d vector(double scale = 10.0) {
    return {rng.uniform(-scale, scale), rng.uniform(-scale, scale), rng.uniform(-scale, scale)};
  }
  Pose3 pose() { return {so3_exp(vector(3.0)), vector()}; }
  std::vector<PosePair> pairs(std::size_t at_least, double noise = 1.0) {
    std::vector<PosePair> out(at_least + rng.index(10));
    for (auto& pair : out) {
      pair.reference = pose();
      pair.estimate = {pair.reference.rotation * so3_exp(vector(0.1 * noise)),
                       pair.reference.translation + vector(noise)};
    }
    return out;
  }
};

std::vector<PosePair> moved(std::vector<PosePair> pairs, const Pose3& T_reference, const Pose3& T_estimate) {
  for (auto& pair : pairs) pair = {pair.stamp, T_estimate * pair.estimate, T_reference * pair.reference};
  return pairs;
}

RC_GTEST_PROP(Ate, DoesNotDependOnEitherFrame, ()) {
  Draw draw;
  const auto pairs = draw.pairs(4);
  const auto here = ate(pairs);
  const auto there = ate(moved(pairs, draw.pose(), draw.pose()));
  RC_ASSERT(std::abs(here->rmse_m - there->rmse_m) < 1e-9);
  RC_ASSERT(std::abs(here->max_m - there->max_m) < 1e-7);
  RC_ASSERT(std::abs(here->median_m - there->median_m) < 1e-7);
}

RC_GTEST_PROP(BestScale, IsFoundWhateverTheFrames, ()) {
  Draw draw;
  const double scale = draw.rng.uniform(0.1, 10.0);
  const auto pairs = scaled(moved(draw.pairs(4, 0.0), draw.pose(), draw.pose()), 1.0 / scale);
  RC_ASSERT(std::abs(best_scale(pairs) / scale - 1.0) < 1e-9);
  RC_ASSERT(ate(scaled(pairs, scale))->max_m < 1e-7);
}

RC_GTEST_PROP(BestScale, LeavesLessThanScalesNearIt, ()) {
  Draw draw;
  const auto pairs = draw.pairs(4);
  const double best = best_scale(pairs);
  for (const double other : {0.99, 1.01})
    RC_ASSERT(ate(scaled(pairs, best))->rmse_m <= ate(scaled(pairs, other * best))->rmse_m + 1e-9);
}

TEST(BestScale, OfOnePlaceIsOne) {
  EXPECT_EQ(best_scale(std::vector<PosePair>{}), 1.0);
  EXPECT_EQ(best_scale(std::vector<PosePair>(3, PosePair{{}, at({1, 2, 3}), at({4, 5, 6})})), 1.0);
}

RC_GTEST_PROP(Ate, OfATrajectoryWithItselfIsZeroAndFindsTheMotion, ()) {
  Draw draw;
  const Pose3 T = draw.pose();
  const auto result = ate(moved(draw.pairs(4, 0.0), T, {}));
  RC_ASSERT(result->max_m < 1e-9);
  RC_ASSERT(result->rmse_deg < 1e-5);
  RC_ASSERT(local(T, result->T_reference_estimate).norm() < 1e-7);
}

RC_GTEST_PROP(Ate, NoOtherAlignmentIsBetter, ()) {
  Draw draw;
  const auto pairs = draw.pairs(1);
  const auto best = ate(pairs);
  Vector6d step;
  step << draw.vector(0.01), draw.vector(0.01);
  RC_ASSERT(best->rmse_m <= ate_aligned(pairs, retract(best->T_reference_estimate, step))->rmse_m + 1e-12);
}

RC_GTEST_PROP(Ate, StatisticsAreOrdered, ()) {
  Draw draw;
  const auto result = ate(draw.pairs(1));
  RC_ASSERT(result->median_m <= result->max_m + 1e-12);
  RC_ASSERT(result->mean_m <= result->rmse_m + 1e-12);
  RC_ASSERT(result->rmse_m <= result->max_m + 1e-12);
}

TEST(Ate, AScaleErrorIsSeen) {
  std::vector<PosePair> pairs;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(1, 1, 0), Eigen::Vector3d(1, -1, 0), Eigen::Vector3d(-1, 1, 0), Eigen::Vector3d(-1, -1, 0)})
    pairs.push_back({{}, at(1.1 * p), at(p)});
  EXPECT_NEAR(ate(pairs)->rmse_m, 0.1 * std::sqrt(2.0), 1e-12);
}

/// One corner of a square lifted by a small h: the best plane through the four passes h / 4 from each of them.
TEST(Ate, HandMadeSquareWithOneCornerLifted) {
  std::vector<PosePair> pairs;
  const double h = 0.004;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(1, 1, 0), Eigen::Vector3d(1, -1, 0), Eigen::Vector3d(-1, 1, 0), Eigen::Vector3d(-1, -1, 0)})
    pairs.push_back({{}, at(p), at(p)});
  pairs[0].estimate.translation.z() += h;
  const auto result = ate(pairs);
  EXPECT_NEAR(result->rmse_m, h / 4, 1e-2 * h);
  EXPECT_NEAR(result->median_m, h / 4, 1e-2 * h);
}

TEST(Ate, StatisticsUnderAGivenAlignment) {
  std::vector<PosePair> pairs(4);
  pairs[1].estimate.translation = {3, 4, 0};
  pairs[2].estimate.translation = {0, 0, 1};
  pairs[3].estimate.rotation = so3_exp({0, 0, std::numbers::pi / 2});
  const auto result = ate_aligned(pairs, {});
  EXPECT_EQ(result->pairs, 4U);
  EXPECT_DOUBLE_EQ(result->rmse_m, std::sqrt(26.0 / 4));
  EXPECT_DOUBLE_EQ(result->mean_m, 1.5);
  EXPECT_DOUBLE_EQ(result->median_m, 0.5);
  EXPECT_DOUBLE_EQ(result->max_m, 5.0);
  EXPECT_DOUBLE_EQ(result->rmse_deg, 45.0);
}

TEST(Ate, NoPairsNoAnswer) {
  EXPECT_FALSE(ate({}));
  EXPECT_FALSE(ate_aligned({}, {}));
}

/// Fewer points than a rotation needs: finite, and no turn that the points do not ask for.
RC_GTEST_PROP(Ate, OneAndTwoPairs, ()) {
  Draw draw;
  auto pairs = draw.pairs(2);
  pairs.resize(2);
  const auto two = ate(pairs);
  const double length_error = std::abs((pairs[0].estimate.translation - pairs[1].estimate.translation).norm() -
                                       (pairs[0].reference.translation - pairs[1].reference.translation).norm());
  RC_ASSERT(std::abs(two->rmse_m - 0.5 * length_error) < 1e-9);
  RC_ASSERT(std::isfinite(two->rmse_deg));
  pairs.resize(1);
  const auto one = ate(pairs);
  RC_ASSERT(one->rmse_m < 1e-12);
  RC_ASSERT(rotation_angle(one->T_reference_estimate) == 0.0);
}

RC_GTEST_PROP(Ate, AStraightLineIsNotRolled, ()) {
  Draw draw;
  const Eigen::Vector3d direction = draw.vector();
  const Pose3 T = draw.pose();
  std::vector<PosePair> pairs;
  for (int i = 0; i < 5; ++i) pairs.push_back({{i}, at(i * direction), at(T * Eigen::Vector3d(i * direction))});
  const auto result = ate(pairs);
  RC_ASSERT(result->max_m < 1e-9);
  const Eigen::Vector3d turned = T.rotation * direction;
  const double between = std::atan2(direction.cross(turned).norm(), direction.dot(turned));
  RC_ASSERT(std::abs(rotation_angle(result->T_reference_estimate) - between) < 1e-6);
}

TEST(Ate, RobotsTogetherShareOneAlignment) {
  const auto robot = [](double x) {
    std::vector<PosePair> pairs;
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)})
      pairs.push_back({{}, at(p + Eigen::Vector3d(x, 0, 0)), at(p)});
    return pairs;
  };
  auto joint = robot(0.2);
  const auto second = robot(-0.2);
  EXPECT_LT(ate(joint)->rmse_m, 1e-12);
  EXPECT_LT(ate(second)->rmse_m, 1e-12);
  joint.insert(joint.end(), second.begin(), second.end());
  EXPECT_NEAR(ate(joint)->rmse_m, 0.2, 1e-12);
}

TEST(Agreement, OnlyEqualStampsCount) {
  const Pose3 T{so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}};
  const std::vector<Eigen::Vector3d> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Trajectory a;
  Trajectory b;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto ns = static_cast<std::int64_t>(i) * 1000;
    a.push_back({{ns}, {Eigen::Quaterniond::Identity(), positions[i]}});
    b.push_back({{ns}, T * a.back().pose});
    b.push_back({{ns + 1}, {Eigen::Quaterniond::Identity(), {99, 99, 99}}});  // 1 ns away is another time
  }
  const auto result = agreement(a, b);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->pairs, positions.size());
  EXPECT_LT(result->max_m, 1e-12);
  EXPECT_LT(local(T, result->T_reference_estimate).norm(), 1e-12);
  EXPECT_FALSE(agreement(a, {{{1}, {}}}));
}

}  // namespace ate_test
}  // namespace tutti::evaluation
