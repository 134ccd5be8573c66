// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/ranging.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::simulation::ranging_test {
namespace {

/// East at 1 m/s, or `north_m` beside that and standing.
Recording robot(std::uint32_t id, double speed_mps, double north_m, int seconds = 1000) {
  Recording out{.robot = RobotId{id}};
  for (int k = 0; k <= seconds; ++k)
    out.reference.push_back(
        {Timestamp{0} + static_cast<double>(k), {Eigen::Quaterniond::Identity(), {speed_mps * k, north_m, 0}}});
  return out;
}

TEST(Ranging, SaysHowFarTheOthersAreThatAreInReach) {
  Recording moves = robot(0, 1.0, 0.0), stands = robot(1, 0.0, 3.0), far = robot(2, 0.0, 500.0);
  const auto ranges = simulate_ranges(moves, {&moves, &stands, &far}, {.every_s = 1.0, .sigma_m = 1e-3}, Rng(1));
  ASSERT_EQ(ranges.size(), 30U);
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    EXPECT_EQ(ranges[k].to, RobotId{1});
    EXPECT_EQ(ranges[k].stamp, Timestamp{0} + static_cast<double>(k));
    EXPECT_NEAR(ranges[k].distance_m, std::hypot(static_cast<double>(k), 3.0), 0.01);
  }
}

TEST(Ranging, ErrsAsConfigured) {
  Recording a = robot(0, 0.0, 0.0, 20'000), b = robot(1, 0.0, 10.0, 20'000);
  double square = 0.0;
  int wrong = 0;
  const auto ranges = simulate_ranges(a, {&a, &b}, {.every_s = 1.0, .sigma_m = 0.2, .wrong_share = 0.2}, Rng(2));
  for (const RobotRange& range : ranges) {
    const bool is_wrong = range.distance_m > 12.5;
    wrong += is_wrong ? 1 : 0;
    square += std::pow(range.distance_m - (is_wrong ? 15.0 : 10.0), 2);
  }
  EXPECT_NEAR(wrong / 20'001.0, 0.2, 0.02);
  EXPECT_NEAR(square / 20'001.0, 0.04, 0.004);
}

}  // namespace
}  // namespace tutti::simulation::ranging_test
