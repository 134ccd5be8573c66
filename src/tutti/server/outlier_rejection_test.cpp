// SPDX-License-Identifier: BSD-3-Clause
// Outlier rejection: wrong closures and failed odometry, distinguished with one setting.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/sanitized.hpp"
#include "support/server/corridor_run.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {
namespace outlier_rejection_test {

using test::corridor_run;
using test::CorridorRun;
using test::CorridorRunConfig;
using test::Failure;
using test::failure;
using test::rmse;

MapEstimate judge(const CorridorRun& run) { return estimate_map(run.submaps, run.verdicts, {}); }

std::size_t accepted_wrong(const CorridorRun& run, const MapEstimate& map) {
  return static_cast<std::size_t>(std::ranges::count_if(
      map.closures, [&](const JudgedClosure& c) { return c.accepted && test::is_wrong(run, c.closure); }));
}

double seconds_of(const MapEstimate& map, RobotId robot, std::uint32_t index) {
  const auto at = std::ranges::lower_bound(map.nodes, KeyframeId{robot, index}, {}, &MapNode::id);
  return at->stamp - Timestamp{1'000'000'000};
}

TEST(OutlierRejection, ThirtyPercentWrongClosuresCostLittle) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(4U); ++seed) {
    CorridorRunConfig config;
    const CorridorRun right = corridor_run(config, seed);
    config.closures.wrong_share = 0.3;
    const CorridorRun run = corridor_run(config, seed);
    const MapEstimate map = judge(run);
    EXPECT_LT(rmse(run, map), 1.2 * rmse(right, judge(right))) << seed;
    EXPECT_EQ(accepted_wrong(run, map), 0U) << seed;
    EXPECT_TRUE(map.failed_odometry.empty()) << seed;
  }
}

TEST(OutlierRejection, FailedOdometryIsRepairedAmongWrongClosures) {
  for (const double wrong_share : {0.0, 0.1, 0.3})
    for (std::uint64_t seed = 1; seed <= tutti::seeds(2U); ++seed) {
      CorridorRunConfig config;
      config.closures.wrong_share = wrong_share;
      config.failures = {failure(0, 170, 190, 1.5, 1.5, 20)};
      const CorridorRun run = corridor_run(config, seed);
      const MapEstimate map = judge(run);
      EXPECT_LT(rmse(run, map), 0.2) << seed;
      EXPECT_LE(accepted_wrong(run, map), 1U) << seed;  // one that the map hardly pays for, and that moves nothing
      double turn = 0.0;                                // a slow failure may be found in parts
      for (const FailedOdometry& failed : map.failed_odometry) {
        EXPECT_EQ(failed.chain.robot, RobotId{0});
        EXPECT_LT(seconds_of(map, {0}, failed.from), 190.0);
        EXPECT_GT(seconds_of(map, {0}, failed.to), 170.0);
        turn += failed.jump_rad;
      }
      EXPECT_NEAR(turn, 20 * kRadPerDeg, 3 * kRadPerDeg) << seed;
    }
}

TEST(OutlierRejection, FailedOdometryWithoutClosuresAroundIsRepaired) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(3U); ++seed) {
    CorridorRunConfig config;
    config.closures.wrong_share = 0.1;
    config.failures = {failure(0, 165, 195, -1.5, 1.0, -15)};
    config.blind = {failure(0, 150, 210, 0, 0, 0)};
    const CorridorRun run = corridor_run(config, seed);
    EXPECT_LT(rmse(run, judge(run)), 0.2) << seed;
  }
}

TEST(OutlierRejection, SeveralFailuresAreRepaired) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(2U); ++seed) {
    CorridorRunConfig config;
    config.closures.wrong_share = 0.1;
    config.failures = {failure(0, 130, 150, 2, 0, -20), failure(1, 250, 270, 0, 2, 25)};
    const CorridorRun different = corridor_run(config, seed);
    EXPECT_LT(rmse(different, judge(different)), 0.21) << seed;
    config.failures[1].robot = {0};
    const CorridorRun same = corridor_run(config, seed);
    EXPECT_LT(rmse(same, judge(same)), 0.2) << seed;
    config.failures = {failure(0, 150, 150, 1, 0, 10), failure(1, 230, 230, 0, 1, -10)};
    const CorridorRun slips = corridor_run(config, seed);
    EXPECT_LT(rmse(slips, judge(slips)), 0.1) << seed;
  }
}

TEST(OutlierRejection, ASlipIsFoundNearItsStep) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(3U); ++seed) {
    CorridorRunConfig config;
    config.keyframe_m = 0.2;
    config.closures.wrong_share = 0.1;
    config.failures = {failure(0, 180, 180, 0, 0, 20)};
    const CorridorRun run = corridor_run(config, seed);
    const MapEstimate map = judge(run);
    EXPECT_LT(rmse(run, map), 0.1) << seed;
    ASSERT_EQ(map.failed_odometry.size(), 1U) << seed;
    const FailedOdometry& failed = map.failed_odometry[0];
    EXPECT_LE(failed.to, failed.from + 10) << seed;
    EXPECT_NEAR(seconds_of(map, {0}, failed.from), 180.0, 4.0) << seed;
    EXPECT_NEAR(seconds_of(map, {0}, failed.to), 180.0, 4.0) << seed;
    EXPECT_NEAR(failed.jump_rad, 20 * kRadPerDeg, 2 * kRadPerDeg) << seed;
  }
}

// Odometry that turns 0.02 degrees a metre wrongly and states a sixth of that: by its covariance nearly all right
// closures are inconsistent with it and with each other.
TEST(OutlierRejection, OdometryThatStatesTooLittleOfItsErrorsCostsNoClosures) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(3U); ++seed) {
    CorridorRunConfig config;
    config.odometry.yaw_drift_deg_per_m = 0.02;
    const CorridorRun honest = corridor_run(config, seed);
    config.odometry.stated_sigma_factor = 1.0 / 6.0;
    const CorridorRun run = corridor_run(config, seed);
    const MapEstimate map = judge(run);
    const auto accepted = std::ranges::count_if(map.closures, &JudgedClosure::accepted);
    EXPECT_GT(static_cast<double>(accepted), 0.95 * static_cast<double>(map.closures.size())) << seed;
    EXPECT_TRUE(map.failed_odometry.empty()) << seed;
    EXPECT_LT(rmse(run, map), 1.2 * rmse(honest, judge(honest))) << seed;
    EXPECT_GT(map.understated.at(RobotId{0}), 4.0) << seed;
  }
}

/// All loops over a small failure that no closure measures miss by it, but the map fits: odometry is not worse
/// everywhere.
TEST(OutlierRejection, OdometryThatFailsOnceStatesItsErrorsElsewhere) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(3U); ++seed) {
    CorridorRunConfig config;
    config.failures = {failure(0, 170, 190, 0, 0, 3)};
    config.blind = {failure(0, 165, 195, 0, 0, 0)};
    const MapEstimate map = judge(corridor_run(config, seed));
    EXPECT_TRUE(map.understated.empty()) << seed;
    EXPECT_NEAR(map.cost / static_cast<double>(map.degrees_of_freedom), 1.0, 0.04) << seed;
  }
}

/// Odometry that climbs, little by little, three metres that are not there.
Failure climb(double from_s, double until_s) {
  Failure out = failure(0, from_s, until_s, 0, 0, 0);
  out.jump(2) = 3.0;
  return out;
}

TEST(OutlierRejection, AFailureLittleByLittleIsFoundWhereItHappened) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(3U); ++seed) {
    CorridorRunConfig config;
    config.closures.wrong_share = 0.1;
    config.failures = {climb(230, 270)};
    const CorridorRun run = corridor_run(config, seed);
    const MapEstimate map = judge(run);
    ASSERT_FALSE(map.failed_odometry.empty()) << seed;
    double climbed = 0.0;  // in parts, maybe, one after the other
    for (const FailedOdometry& failed : map.failed_odometry) {
      EXPECT_EQ(failed.chain.robot, RobotId{0});
      climbed += failed.jump_m;
    }
    EXPECT_NEAR(seconds_of(map, {0}, map.failed_odometry.front().from), 230.0, 8.0) << seed;
    EXPECT_NEAR(seconds_of(map, {0}, map.failed_odometry.back().to), 270.0, 8.0) << seed;
    EXPECT_NEAR(climbed, 3.0, 0.5) << seed;
    EXPECT_EQ(accepted_wrong(run, map), 0U) << seed;
    EXPECT_LT(rmse(run, map), 0.1) << seed;
  }
}

TEST(OutlierRejection, AFailureWhereNoClosureWasIsFoundWhereItMustHaveBeen) {
  std::vector<double> off_s;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CorridorRunConfig config;
    config.closures.wrong_share = 0.1;
    config.failures = {failure(0, 200, 230, 0, 0, 10)};
    config.blind = {failure(0, 160, 270, 0, 0, 0)};
    const CorridorRun run = corridor_run(config, seed);
    const MapEstimate map = judge(run);
    ASSERT_EQ(map.failed_odometry.size(), 1U) << seed;
    const FailedOdometry& failed = map.failed_odometry.front();
    EXPECT_LT(seconds_of(map, {0}, failed.from), 230.0) << seed;
    EXPECT_GT(seconds_of(map, {0}, failed.to), 200.0) << seed;
    off_s.push_back(std::abs(seconds_of(map, {0}, failed.from) - 200.0));
    off_s.push_back(std::abs(seconds_of(map, {0}, failed.to) - 230.0));
  }
  std::ranges::sort(off_s);
  EXPECT_LT(off_s[off_s.size() / 2], 4.0);
  EXPECT_LT(off_s.back(), 16.0);
}

TEST(OutlierRejection, AFailureThatNothingContradictsDoesNoHarm) {
  CorridorRunConfig config;
  config.closures.wrong_share = 0.1;
  const CorridorRun intact = corridor_run(config, 2);
  config.failures = {failure(0, 385, 400, 2, 0, -20)};
  config.blind = {failure(0, 380, 400, 0, 0, 0)};
  const CorridorRun run = corridor_run(config, 2);
  const MapEstimate map = judge(run);
  EXPECT_TRUE(map.failed_odometry.empty());
  EXPECT_LT(rmse(run, map, RobotId{1}), 1.1 * rmse(intact, judge(intact), RobotId{1}));
}

TEST(OutlierRejection, CorridorsThatLookAlikeBlameNothing) {
  for (const double length_s : {30.0, 60.0})
    for (const double second_from_s : {230.0, 400.0 - length_s})
      for (const std::uint32_t robots : {1U, 2U}) {
        CorridorRunConfig config{.robots = robots, .world = {.rows = 3, .columns = 4}};
        config.closures = {.radius_m = 2.0, .max_heading_deg = 60.0, .wrong_share = 0.0};
        const CorridorRun right = corridor_run(config, 2);
        config.look_alikes = {{RobotId{0}, 30.0, RobotId{robots - 1}, second_from_s, length_s}};
        const CorridorRun run = corridor_run(config, 2);
        const MapEstimate map = judge(run);
        EXPECT_GT(map.closures.size(), judge(right).closures.size());
        EXPECT_EQ(accepted_wrong(run, map), 0U) << length_s << " s, " << second_from_s << " s, " << robots;
        EXPECT_TRUE(map.failed_odometry.empty());
        // One robot may lose the few right closures it has with the others; its odometry is left.
        EXPECT_LT(rmse(run, map), (robots == 1 ? 1.65 : 1.2) * rmse(right, judge(right)));
      }
}

TEST(OutlierRejection, BothSidesOfAMissingSubmapAreJudged) {
  CorridorRunConfig config;
  config.closures.wrong_share = 0.3;
  CorridorRun run = corridor_run(config, 3);
  std::erase_if(run.verdicts, [](const auto& verdict) {
    const auto& [first, second] = verdict.first;
    return first == SubmapId{RobotId{0}, 10} || second == SubmapId{RobotId{0}, 10};
  });
  run.submaps.erase({RobotId{0}, 10});
  const MapEstimate map = judge(run);
  EXPECT_EQ(map.components, 1U);
  std::size_t before = 0;
  std::size_t after = 0;
  const std::uint32_t gap = run.submaps.at({RobotId{0}, 9})->keyframes.back().index;
  for (const JudgedClosure& c : map.closures)
    if (c.accepted && c.closure.from.chain.robot == RobotId{0}) ++(c.closure.from.index <= gap ? before : after);
  EXPECT_GT(before, 20U);
  EXPECT_GT(after, 20U);
  EXPECT_EQ(accepted_wrong(run, map), 0U);
}

TEST(OutlierRejection, TheProxyGraphIsAsSureOfARepairAsTheClosures) {
  CorridorRunConfig config;
  config.failures = {failure(0, 165, 195, -1.5, 1.0, -15)};
  config.blind = {failure(0, 150, 210, 0, 0, 0)};
  const CorridorRun run = corridor_run(config, 1);
  const MapEstimate map = judge(run);
  ASSERT_EQ(map.failed_odometry.size(), 1U);
  const FailedOdometry& failed = map.failed_odometry.front();
  const ProxyGraph graph = monitor_graph(map, 1, {});
  Matrix6d sum = Matrix6d::Zero();
  for (const ProxyNode& node : graph.nodes) {
    const double s = node.stamp - Timestamp{1'000'000'000};
    if (node.chain.robot != RobotId{0} || s < seconds_of(map, {0}, failed.from) || s > seconds_of(map, {0}, failed.to))
      continue;
    const Matrix6d to_world = adjoint(node.T_world_body);
    sum += to_world * node.covariance * to_world.transpose();
  }
  // The closures know the turn far better than the 15 degrees the odometry missed.
  EXPECT_LT(std::sqrt(sum(5, 5)), 1.0 * kRadPerDeg);
  EXPECT_GT(std::sqrt(sum(5, 5)), 0.01 * kRadPerDeg);
}

}  // namespace outlier_rejection_test
}  // namespace tutti::server
