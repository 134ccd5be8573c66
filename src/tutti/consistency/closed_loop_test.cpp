// SPDX-License-Identifier: BSD-3-Clause
// The whole chain over a mission: proxy graph, comparison, policy, ledger, onboard optimisation.
#include "support/consistency/closed_loop.hpp"

#include <gtest/gtest.h>

namespace tutti::consistency {
namespace closed_loop_test {

using namespace test;

/// 60 nodes, yaw drift of 0.3 degrees per metre and a scale error of 0.3 %: raw odometry some 0.7 m off.
Mission short_mission(std::uint64_t seed) {
  OdometryNoise noise{.translation_m = 0.02, .rotation_rad = 0.0018};
  noise.yaw_bias_rad = 0.3 * std::numbers::pi / 180.0;
  noise.scale_bias = 0.003;
  return corridor_mission(60, noise, seed, {.smooth_m = 0.02, .local_m = 0.003, .local_rad = 0.0005});
}

TEST(ClosedLoop, SpectralBringsAShortRunToTheServersMap) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto result = run_closed_loop(short_mission(seed), {});
    EXPECT_GT(result.onboard_m, 0.3);
    EXPECT_LT(result.agreement_m, 0.03) << "seed " << seed;
    EXPECT_LT(result.corrected_m, 0.035) << "seed " << seed;
  }
}

// The paper's recipe adds and never takes back: 343 to 406 links with seeds 1 to 5.
TEST(ClosedLoop, OnALongerRunSpectralTakesALinkPerNode) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto many = run_closed_loop(corridor_mission(400, {}, seed), {});
    EXPECT_GT(many.onboard_m, 0.3);
    EXPECT_LT(many.agreement_m, 0.04) << "seed " << seed;  // 0.028
    EXPECT_GT(many.constraints, 300U) << "seed " << seed;
    EXPECT_LT(many.constraints, 480U) << "seed " << seed;
  }
}

TEST(ClosedLoop, EveryNodeReachesTheServersMap) {
  LoopConfig config;
  config.policy.name = "every_node";
  const auto all = run_closed_loop(corridor_mission(300, {}, 2), config);
  EXPECT_EQ(all.constraints, 299U);
  EXPECT_LT(all.agreement_m, 0.015);
}

TEST(ClosedLoop, WorksOnReducedProxyGraphs) {
  LoopConfig config;
  config.proxy_graph.node_budget = 120;
  const auto result = run_closed_loop(corridor_mission(300, {}, 3), config);
  EXPECT_LT(result.agreement_m, 0.06);
}

// Constraints of an old map are measured again, not fought by new ones.
TEST(ClosedLoop, FollowsAMapThatChanges) {
  auto mission = corridor_mission(300, {}, 4);
  mission.settling = true;
  const auto result = run_closed_loop(mission, {});
  EXPECT_GT(result.replaced, 1000U);  // some 200 links, most of them many times
  EXPECT_LT(result.agreement_m, 0.03);
}

// Without any closure the server's map is odometry: nothing to correct.
TEST(ClosedLoop, AServerThatKnowsNothingChangesNothing) {
  auto mission = corridor_mission(150, {}, 5);
  mission.late_closures = true;  // the corridor first comes back after 320 m
  const auto result = run_closed_loop(mission, {});
  EXPECT_EQ(result.constraints, 0U);
  EXPECT_LT(result.worst_agreement_m, 1e-6);
}

}  // namespace closed_loop_test
}  // namespace tutti::consistency
