// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/rpe.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace rpe_test {

constexpr std::int64_t kSecond = 1'000'000'000;

Pose3 at_x(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 0}}; }

/// `n` pairs, 2 m and 1 s apart; the estimate drifts by `scale` and turns `turn_rad` a step.
std::vector<PosePair> line(int n, double scale, double turn_rad = 0.0) {
  std::vector<PosePair> pairs;
  Pose3 estimate;
  for (int i = 0; i < n; ++i) {
    pairs.push_back({{i * kSecond}, estimate, at_x(2.0 * i)});
    estimate = estimate * Pose3{so3_exp({0, 0, turn_rad}), {2.0 * scale, 0, 0}};
  }
  return pairs;
}

TEST(Rpe, HandMadeScaleError) {
  const auto pairs = line(11, 1.01);
  const auto second = rpe_over_time(pairs, 1.0);
  EXPECT_EQ(second->count, 10U);
  EXPECT_NEAR(second->rmse_m, 0.02, 1e-12);
  EXPECT_NEAR(second->rmse_deg, 0.0, 1e-6);
  const auto three = rpe_over_time(pairs, 3.0);
  EXPECT_EQ(three->count, 8U);
  EXPECT_NEAR(three->rmse_m, 0.06, 1e-12);
  const auto ten_metres = rpe_over_distance(pairs, 10.0);
  EXPECT_EQ(ten_metres->count, 6U);
  EXPECT_NEAR(ten_metres->rmse_m, 0.1, 1e-12);
}

TEST(Rpe, HandMadeTurn) {
  const double turn_rad = 0.01;
  const auto result = rpe_over_time(line(11, 1.0, turn_rad), 2.0);
  EXPECT_NEAR(result->rmse_deg, 2 * turn_rad * 180.0 / M_PI, 1e-9);
  // After one turn, the second step of 2 m ends 2 * 2 sin(turn / 2) beside the straight line.
  EXPECT_NEAR(result->rmse_m, 4.0 * std::sin(0.5 * turn_rad), 1e-9);
}

RC_GTEST_PROP(Rpe, DoesNotDependOnEitherFrame, ()) {
  const auto any = [] { return static_cast<double>(*rc::gen::inRange(-1000, 1000)) * 1e-2; };
  auto pairs = line(8, 1.02, 0.05);
  const auto here = rpe_over_time(pairs, 2.0);
  const auto here_m = rpe_over_distance(pairs, 5.0);
  const Pose3 T_a{so3_exp({any(), any(), any()}), {any(), any(), any()}};
  const Pose3 T_b{so3_exp({any(), any(), any()}), {any(), any(), any()}};
  for (auto& pair : pairs) pair = {pair.stamp, T_a * pair.estimate, T_b * pair.reference};
  RC_ASSERT(std::abs(here->rmse_m - rpe_over_time(pairs, 2.0)->rmse_m) < 1e-9);
  RC_ASSERT(std::abs(here->rmse_deg - rpe_over_time(pairs, 2.0)->rmse_deg) < 1e-6);
  RC_ASSERT(std::abs(here_m->rmse_m - rpe_over_distance(pairs, 5.0)->rmse_m) < 1e-9);
}

TEST(Rpe, OneBadStepIsBadOnlyForTheIntervalsAcrossIt) {
  auto pairs = line(11, 1.0);
  for (std::size_t i = 5; i < pairs.size(); ++i) pairs[i].estimate.translation.y() += 3.0;
  EXPECT_NEAR(rpe_over_time(pairs, 1.0)->rmse_m, 3.0 / std::sqrt(10.0), 1e-12);
  EXPECT_NEAR(rpe_over_time(pairs, 2.0)->rmse_m, 3.0 * std::sqrt(2.0 / 9.0), 1e-12);
}

TEST(Rpe, GapsAreLeftOut) {
  auto pairs = line(11, 1.0);
  pairs.erase(pairs.begin() + 4, pairs.begin() + 7);  // 3 s -> 7 s
  EXPECT_EQ(rpe_over_time(pairs, 1.0)->count, 6U);
  EXPECT_EQ(rpe_over_time(pairs, 1.9)->count, 4U);  // 2 s apart: 0-2 1-3 7-9 8-10
  EXPECT_EQ(rpe_over_distance(pairs, 2.0)->count, 6U);
}

TEST(Rpe, RoundingOfTimesAddsNoSample) {
  for (const int rate_hz : {4, 8, 10, 20}) {
    std::vector<PosePair> pairs;
    const Timestamp start{1'403'636'579'763'555'584};
    for (int i = 0; i < 4000; ++i) pairs.push_back({{start.ns + i * kSecond / rate_hz}, at_x(1.01 * i), at_x(i)});
    for (const int samples : {1, rate_hz / 2, rate_hz}) {
      const auto result = rpe_over_time(pairs, static_cast<double>(samples) / rate_hz);
      EXPECT_EQ(result->count, static_cast<std::size_t>(4000 - samples));
      EXPECT_NEAR(result->rmse_m, 0.01 * samples, 1e-9) << rate_hz;
    }
  }
}

TEST(Rpe, RoundingOfTheDistanceAddsNoSample) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < 4000; ++i) pairs.push_back({{i * kSecond}, at_x(0.101 * i), at_x(0.1 * i)});
  const auto ten_metres = rpe_over_distance(pairs, 10.0);
  EXPECT_EQ(ten_metres->count, 3900U);
  EXPECT_NEAR(ten_metres->rmse_m, 0.1, 1e-9);
}

TEST(Rpe, TooShortIsNoAnswer) {
  EXPECT_FALSE(rpe_over_time({}, 1.0));
  EXPECT_FALSE(rpe_over_distance({}, 1.0));
  EXPECT_FALSE(rpe_over_time(line(1, 1.0), 1.0));
  EXPECT_FALSE(rpe_over_time(line(2, 1.0), 1.5));
  EXPECT_FALSE(rpe_over_distance(std::vector<PosePair>(5), 1.0));  // never moves
  EXPECT_TRUE(rpe_over_time(line(2, 1.0), 1.0));
}

TEST(Rpe, MisuseIsCaught) {
  EXPECT_THROW((void)rpe_over_time(line(3, 1.0), 0.0), std::logic_error);
  EXPECT_THROW((void)rpe_over_time(std::vector<PosePair>(2), 1.0), std::logic_error);  // equal stamps
}

}  // namespace rpe_test
}  // namespace tutti::evaluation
