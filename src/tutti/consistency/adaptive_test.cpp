// SPDX-License-Identifier: BSD-3-Clause
// The policy `adaptive`: nothing while the two agree, few links where drift was born, and no churn.
#include <gtest/gtest.h>

#include <cstdio>

#include "support/consistency/closed_loop.hpp"
#include "support/sanitized.hpp"

namespace tutti::consistency {
namespace adaptive_test {

using namespace test;

/// One robot with a server whose map is as accurate as `map` states.
struct Scene {
  std::vector<Pose3> server;
  std::vector<Pose3> increments;
  const WalkWithClosures* map = nullptr;
  PolicyConfig config;
  Ledger ledger;
  std::uint64_t update = 0;

  /// The next proxy graph: compares, chooses, books.
  LedgerUpdate receive() {
    auto graph = build_proxy_graph(++update, server_nodes(kAlpha, server), {{kAlpha, 0}}, {});
    graph.uncertainties = {map->uncertainty(graph, kAlpha)};
    const auto nodes = robot_nodes(integrate({}, increments), increments);
    const auto pairs = synchronise(graph, kAlpha, nodes).pairs;
    const auto policy = *make_policy(config, {});
    const DisagreementTest test(graph, kAlpha, pairs, DisagreementConfig().for_run_of(pairs.size()));
    const Disagreement found = test(odometry_at(nodes, pairs));
    const auto selection = policy->choose({graph, kAlpha, nodes, pairs, ledger, &test, &found});
    return ledger.update(selection.constraints, selection.replaces_all);
  }
};

std::vector<Pose3> steps_of(const std::vector<Pose3>& poses) {
  std::vector<Pose3> out;
  for (std::size_t n = 1; n < poses.size(); ++n) out.push_back(poses[n - 1].inverse() * poses[n]);
  return out;
}

constexpr std::size_t kNodes = 200;
const WalkWithClosures& usual_map() {
  static const WalkWithClosures map(kNodes, 25, {0.005, 3e-4}, {0.01, 1e-3});
  return map;
}

/// The robot differs from the server by what the server allows for.
Scene agreeing(std::uint64_t seed) {
  const auto truth = corridor(kNodes);
  return {.server = moved({so3_exp(Eigen::Vector3d(0, 0, 2.0)), {30, -20, 1}}, truth),
          .increments = steps_of(usual_map().displace(truth, Rng(seed))),
          .map = &usual_map()};
}

/// And drifts on top of it, honestly.
Scene drifting(std::uint64_t seed) {
  Scene out = agreeing(seed);
  out.increments = odometry_increments(integrate({}, out.increments), {.yaw_bias_rad = 5e-4}, Rng(seed));
  return out;
}

TEST(Adaptive, AddsNothingWhileTheTwoAgree) {
  for (std::uint64_t seed = 0; seed < tutti::seeds(40U); ++seed) {
    Scene scene = agreeing(seed);
    for (int i = 0; i < 2; ++i) scene.receive();
    EXPECT_EQ(scene.ledger.size(), 0U) << "seed " << seed;
  }
}

TEST(Adaptive, AddsLinksOnceItDrifts) {
  for (std::uint64_t seed = 0; seed < tutti::seeds(10U); ++seed)
    EXPECT_GT(drifting(seed).receive().added, 0U) << "seed " << seed;
}

TEST(Adaptive, LinksAreAChainFromEarlierToLater) {
  Scene scene = drifting(1);
  scene.receive();
  const auto& kept = scene.ledger.constraints();
  for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_EQ(kept[i - 1].to_stamp, kept[i].from_stamp);
}

TEST(Adaptive, HoldsOnWhileNothingChanges) {
  for (std::uint64_t seed = 0; seed < tutti::seeds(3U); ++seed) {
    Scene scene = drifting(seed);
    const std::size_t links = scene.receive().added;
    ASSERT_GT(links, 0U);
    const Ledger first = scene.ledger;
    for (int i = 0; i < 20; ++i) {
      const LedgerUpdate update = scene.receive();
      EXPECT_EQ(update.unchanged, links);
      EXPECT_EQ(update.added + update.replaced + update.removed + update.withdrawn, 0U);
    }
    EXPECT_EQ(scene.ledger, first);
  }
}

// A wrong closure bends the map, the robot follows; then it is gone, and all the server has is odometry again.
TEST(Adaptive, WithdrawsAllWhenTheMapComesBackToOdometry) {
  Scene scene = agreeing(3);
  scene.server = moved(scene.server.front(), integrate({}, scene.increments));
  const auto right = scene.server;
  for (std::size_t n = 80; n < kNodes; ++n) scene.server[n].translation.y() += 2.0;
  EXPECT_GT(scene.receive().added, 0U);
  scene.receive();
  const std::size_t kept = scene.ledger.size();
  scene.server = right;
  EXPECT_EQ(scene.receive().removed, kept);
  EXPECT_EQ(scene.ledger.size(), 0U);
  scene.receive();
  EXPECT_EQ(scene.ledger.size(), 0U);
}

TEST(Adaptive, SameInputSameLinks) {
  Scene a = drifting(4), b = drifting(4);
  for (int i = 0; i < 3; ++i) {
    a.receive();
    b.receive();
  }
  EXPECT_EQ(a.ledger, b.ledger);
}

// One bad step and all else right: few links, which end where it happened.
TEST(Adaptive, PutsALinkAroundASingleJump) {
  Scene scene = agreeing(5);
  scene.increments = steps_of(scene.server);
  scene.increments[119] = scene.increments[119] * Pose3{so3_exp(Eigen::Vector3d(0, 0, 0.1)), {0.5, 0.5, 0.0}};
  scene.receive();
  bool around = false;
  for (const Constraint& c : scene.ledger.constraints())
    around |= c.from / 3 <= 119 && c.to / 3 >= 120 && (c.to - c.from) / 3 <= 3;
  EXPECT_TRUE(around);
  EXPECT_LE(scene.ledger.size(), 40U);
}

TEST(AdaptiveLoop, EndsWhereTheServerHasIt) {
  LoopConfig config;
  config.policy.name = "adaptive";
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto result = run_closed_loop(corridor_mission(200, {.translation_m = 0.02, .yaw_bias_rad = 5e-4}, seed,
                                                         {.smooth_m = 0.03, .local_m = 0.01, .local_rad = 0.001}),
                                        config);
    std::printf("[ MEASURED ] onboard %.3f m, corrected %.3f m, off the server's map %.3f m, %zu links, %zu replaced\n",
                result.onboard_m, result.corrected_m, result.agreement_m, result.constraints, result.replaced);
    EXPECT_GT(result.onboard_m, 0.3);
    EXPECT_LT(result.agreement_m, 0.25 * 0.036) << "seed " << seed;  // a quarter of the server's own error
  }
}

TEST(AdaptiveLoop, AServerThatKnowsNothingChangesNothing) {
  auto mission = corridor_mission(150, {}, 5);
  mission.late_closures = true;  // the corridor first comes back after 320 m
  LoopConfig config;
  config.policy.name = "adaptive";
  const auto result = run_closed_loop(mission, config);
  EXPECT_EQ(result.constraints, 0U);
  EXPECT_LT(result.worst_agreement_m, 1e-6);
}

}  // namespace adaptive_test
}  // namespace tutti::consistency
