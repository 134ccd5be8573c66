// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/policy.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "support/consistency/runs.hpp"

namespace tutti::consistency {
namespace policy_test {

using test::kAlpha;
using Pairs = std::set<std::pair<std::size_t, std::size_t>>;  // of nodes

/// A scene whose disagreement is set by hand.
struct Scene {
  explicit Scene(std::size_t length)
      : graph(test::proxy_graph(test::corridor(length))), nodes(test::robot_nodes(test::corridor(length))) {
    for (std::size_t n = 0; n < length; ++n) comparison.pairs.push_back({n, n});
    comparison.disagreement = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(length), 7);
  }
  [[nodiscard]] Selection choose(const std::string& name, std::optional<std::size_t> budget = {},
                                 const PolicyConfig& config = {}, std::uint64_t seed = 1) const {
    return (*make_policy(name, config))->choose({graph, kAlpha, nodes, comparison, budget, Rng(seed), ledger});
  }
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
  Comparison comparison;
  Ledger ledger;
};

Pairs linked(const Selection& selection, std::optional<ConstraintKind> kind = {}) {
  Pairs out;
  for (const Constraint& c : selection.constraints)
    if (!kind || c.kind == *kind) out.emplace(c.from / 3, c.to / 3);  // robot_nodes: chain_index = 3 node
  return out;
}

const PolicyConfig kConfig{.threshold_large_m = 0.5, .threshold_mid_m = 0.4, .threshold_small_m = 0.3};

TEST(Policy, UnknownNameIsAConfigurationError) {
  const auto policy = make_policy("oracle", {});
  ASSERT_FALSE(policy.has_value());
  EXPECT_EQ(policy.error().code, ErrorCode::configuration);
}

TEST(Policy, NamesMatchTheFactory) {
  for (const char* name : {"none", "every_node", "every_node_2", "spectral", "uniform", "random", "skeleton"})
    EXPECT_EQ((*make_policy(name, {}))->name(), name);
}

TEST(Policy, ZeroOrOneNodeGivesNothingAndTakesNothingAway) {
  for (const std::size_t length : {0U, 1U})
    for (const char* name : {"every_node", "every_node_2", "spectral", "uniform", "random", "skeleton"}) {
      Scene scene(length);
      scene.comparison.disagreement.setConstant(10.0);
      const auto selection = scene.choose(name, 5);
      EXPECT_TRUE(selection.constraints.empty()) << name;
      EXPECT_FALSE(selection.replaces_all) << name;
    }
}

TEST(Policy, EveryLinkIsMeasuredOnTheServersMap) {
  Scene scene(60);
  scene.comparison.disagreement.setConstant(1.0);
  for (RobotNode& node : scene.nodes) node.T_map_body.translation *= 1.5;
  for (const char* name : {"every_node", "every_node_2", "spectral", "uniform", "random"}) {
    const auto selection = scene.choose(name, 40);
    EXPECT_FALSE(selection.constraints.empty()) << name;
    for (const Constraint& c : selection.constraints) {
      const Pose3 expected =
          scene.graph.nodes[c.from / 3].T_world_body.inverse() * scene.graph.nodes[c.to / 3].T_world_body;
      EXPECT_LT(local(c.measurement.T_a_b, expected).norm(), 1e-10) << name;
      EXPECT_LT(c.from_stamp, c.to_stamp) << name;
    }
  }
}

TEST(EveryNode, LinksNeighboursInTime) {
  Scene scene(5);
  EXPECT_EQ(linked(scene.choose("every_node", 1)), (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4}}));
  EXPECT_EQ(linked(scene.choose("every_node_2", 1)), (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 2}, {1, 3}, {2, 4}}));
  EXPECT_TRUE(scene.choose("every_node").replaces_all);
}

TEST(Spectral, NothingBelowTheThresholds) {
  Scene scene(50);
  EXPECT_TRUE(scene.choose("spectral", {}, kConfig).constraints.empty());
  EXPECT_FALSE(scene.choose("spectral", {}, kConfig).replaces_all);
}

TEST(Spectral, AGroupsDisagreementIsTheSumOverItsScales) {
  Scene scene(50);
  scene.comparison.disagreement.row(20).segment(4, 3).setConstant(0.09);  // 0.27
  EXPECT_TRUE(scene.choose("spectral", {}, kConfig).constraints.empty());
  scene.comparison.disagreement.row(20).segment(4, 3).setConstant(0.11);  // 0.33
  EXPECT_EQ(linked(scene.choose("spectral", {}, kConfig)), (Pairs{{19, 20}, {20, 21}}));
}

TEST(Spectral, SmallMidAndLargeScalesAskForTheirLinks) {
  Scene scene(50);
  auto& d = scene.comparison.disagreement;
  d(10, 5) = 0.4;
  d(20, 3) = 0.5;
  d(31, 1) = 0.6;
  const auto selection = scene.choose("spectral", {}, kConfig);
  EXPECT_EQ(linked(selection, ConstraintKind::small), (Pairs{{9, 10}, {10, 11}}));
  EXPECT_EQ(linked(selection, ConstraintKind::mid), (Pairs{{15, 20}, {20, 25}}));
  // Node 31 is at 93 s, in submap 9 (90-100 s, first node 30). Straight corridor: the nearest centroids are those of
  // submaps 8, 7, 10, 11; their first nodes are at 81, 72, 102 and 111 s.
  EXPECT_EQ(linked(selection, ConstraintKind::large), (Pairs{{27, 30}, {24, 30}, {30, 34}, {30, 37}}));
}

TEST(Spectral, LargeLinksJumpToARevisitedPlace) {
  Scene scene(330);  // corridor() is back at (0, 0), where it began, after 320 m
  scene.comparison.disagreement(316, 0) = 1.0;
  const auto links = linked(scene.choose("spectral", {}, kConfig), ConstraintKind::large);
  EXPECT_EQ(links.size(), 4U);
  for (const auto& [a, b] : links) {
    EXPECT_TRUE(a == 314 || b == 314);  // the first node of the submap of 316
    EXPECT_LT((scene.graph.nodes[a].T_world_body.translation - scene.graph.nodes[b].T_world_body.translation).norm(),
              9.0);
  }
  EXPECT_LT(links.begin()->first, 20U);
}

TEST(Spectral, AtTheEndsLinksFallAway) {
  Scene scene(4);
  scene.comparison.disagreement.row(0).setConstant(1.0);
  const auto selection = scene.choose("spectral", {}, kConfig);
  EXPECT_EQ(linked(selection, ConstraintKind::small), (Pairs{{0, 1}}));
  EXPECT_TRUE(linked(selection, ConstraintKind::mid).empty());
}

TEST(Spectral, UnderABudgetTheLargestExcessComesFirstAndGroupsTakeTurns) {
  Scene scene(60);
  auto& d = scene.comparison.disagreement;
  d(10, 5) = 0.4;   // small, 1.33 x
  d(40, 6) = 3.0;   // small, 10 x
  d(20, 2) = 0.44;  // mid, 1.1 x
  EXPECT_EQ(linked(scene.choose("spectral", 2, kConfig)), (Pairs{{15, 20}, {20, 25}}));
  EXPECT_EQ(linked(scene.choose("spectral", 4, kConfig)), (Pairs{{15, 20}, {20, 25}, {39, 40}, {40, 41}}));
  EXPECT_EQ(linked(scene.choose("spectral", 5, kConfig)), (Pairs{{15, 20}, {20, 25}, {39, 40}, {40, 41}, {9, 10}}));
  EXPECT_EQ(scene.choose("spectral", 100, kConfig).constraints.size(), 6U);
}

TEST(Spectral, TopTakesTheLargestOverAllGroups) {
  Scene scene(60);
  auto& d = scene.comparison.disagreement;
  for (Eigen::Index n = 0; n < 60; ++n) d(n, 5) = 0.08;
  d(30, 2) = 0.3;
  d(44, 4) = 0.2;
  d(7, 0) = 0.06;
  PolicyConfig config{.classifier = "top", .top_count = 2};
  EXPECT_EQ(linked(scene.choose("spectral", {}, config)), (Pairs{{25, 30}, {30, 35}, {43, 44}, {44, 45}}));
  config.top_count = 10;
  EXPECT_EQ(linked(scene.choose("spectral", {}, config), ConstraintKind::small).size(), 2U + 8U);  // 44 and 0, 1, .. 7
  config.top_threshold_m = 0.29;
  EXPECT_EQ(linked(scene.choose("spectral", {}, config)), (Pairs{{25, 30}, {30, 35}}));
}

TEST(Spectral, MeasuresHeldConstraintsAgainAndCountsThemInTheBudget) {
  Scene scene(60);
  scene.comparison.disagreement(10, 5) = 1.0;
  scene.ledger.update(scene.choose("spectral", {}, kConfig).constraints, false);
  ASSERT_EQ(scene.ledger.size(), 2U);
  scene.comparison.disagreement.setZero();
  scene.comparison.disagreement(30, 5) = 1.0;
  scene.graph.revision = 2;
  scene.graph.nodes[11].T_world_body.translation.z() += 0.5;
  const auto selection = scene.choose("spectral", 3, kConfig);
  EXPECT_EQ(linked(selection), (Pairs{{9, 10}, {10, 11}, {29, 30}}));
  const auto update = scene.ledger.update(selection.constraints, selection.replaces_all);
  EXPECT_EQ(update.added, 1U);
  EXPECT_EQ(update.replaced, 1U);
  EXPECT_EQ(update.unchanged, 1U);
}

RC_GTEST_PROP(Uniform, IsAChainOfEquallyLongLinks, ()) {
  const auto length = *rc::gen::inRange<std::size_t>(2, 150);
  const auto budget = *rc::gen::inRange<std::size_t>(1, 200);
  const auto selection = Scene(length).choose("uniform", budget);
  RC_ASSERT(selection.replaces_all);
  RC_ASSERT(selection.constraints.size() == std::min(budget, length - 1));
  std::size_t at = 0, shortest = length, longest = 0;
  for (const auto& [a, b] : linked(selection)) {
    RC_ASSERT(a == at);
    shortest = std::min(shortest, b - a);
    longest = std::max(longest, b - a);
    at = b;
  }
  RC_ASSERT(at == length - 1);
  RC_ASSERT(longest - shortest <= 1U);
}

TEST(Uniform, ABudgetOfNothingIsNothing) {
  const auto selection = Scene(10).choose("uniform", 0);
  EXPECT_TRUE(selection.constraints.empty());
}

RC_GTEST_PROP(Random, MeetsTheBudgetAndFollowsTheSeed, (std::uint64_t seed)) {
  const Scene scene(120);
  const auto budget = *rc::gen::inRange<std::size_t>(0, 150);
  const auto selection = scene.choose("random", budget, {}, seed);
  RC_ASSERT(selection.constraints.size() == budget);
  RC_ASSERT(linked(selection).size() == budget);
  RC_ASSERT(scene.choose("random", budget, {}, seed).constraints == selection.constraints);
}

TEST(Random, DrawsAllKindsAllOverTheRun) {
  const auto selection = Scene(200).choose("random", 120);
  for (const auto kind : {ConstraintKind::small, ConstraintKind::mid, ConstraintKind::large})
    EXPECT_GT(linked(selection, kind).size(), 10U);
  for (std::size_t quarter = 0; quarter < 4; ++quarter)
    EXPECT_GT(std::ranges::count_if(linked(selection), [&](const auto& l) { return l.first / 50 == quarter; }), 10);
}

TEST(Random, ATinyGraphHasOnlySoManyLinks) {
  const auto selection = Scene(3).choose("random", 50);
  EXPECT_LE(selection.constraints.size(), 3U);
  EXPECT_GE(selection.constraints.size(), 2U);
}

/// The robot's chain bends at one node, everything else agrees.
Scene bent_scene(std::size_t length, std::size_t at_node, double turn_rad) {
  Scene scene(length);
  scene.nodes[at_node].odometry.T_a_b.rotation =
      scene.nodes[at_node].odometry.T_a_b.rotation * so3_exp(Eigen::Vector3d(0, 0, turn_rad));
  return scene;
}

TEST(Skeleton, TakesNothingWhenTheRawChainAgrees) {
  const auto selection = Scene(80).choose("skeleton");
  EXPECT_TRUE(selection.constraints.empty());
  EXPECT_TRUE(selection.replaces_all);  // and gives up what it held
}

TEST(Skeleton, LinksAreAChainFromTheFirstNodeToTheLast) {
  const auto selection = bent_scene(80, 40, 0.2).choose("skeleton");
  ASSERT_GE(selection.constraints.size(), 2U);
  EXPECT_LT(selection.constraints.size(), 40U);
  std::size_t end = 0;
  for (const auto& [from, to] : linked(selection)) {
    EXPECT_EQ(from, end);
    end = to;
  }
  EXPECT_EQ(end, 79U);
}

TEST(Skeleton, LinksAreShortWhereTheDriftWasBorn) {
  const auto links = linked(bent_scene(120, 60, 0.2).choose("skeleton"));
  std::size_t shortest = 120;
  double at = 0.0;
  for (const auto& [from, to] : links)
    if (to - from < shortest) {
      shortest = to - from;
      at = 0.5 * static_cast<double>(from + to);
    }
  EXPECT_LE(shortest, 3U);
  EXPECT_NEAR(at, 60.0, 5.0);
}

TEST(Skeleton, ABudgetBuysTheWorstRunsFirst) {
  const Scene scene = bent_scene(120, 60, 0.2);
  const std::size_t all = scene.choose("skeleton").constraints.size();
  for (const std::size_t budget : {1U, 2U, 4U})
    EXPECT_EQ(scene.choose("skeleton", budget).constraints.size(), std::min(budget, all));
  EXPECT_TRUE(linked(scene.choose("skeleton", 1)).contains({0, 119}));
}

TEST(Skeleton, LooksAtRawOdometryNotAtWhatItCorrectedBefore) {
  Scene scene = bent_scene(80, 40, 0.2);
  const auto before = linked(scene.choose("skeleton"));
  for (RobotNode& node : scene.nodes) node.T_map_body = node.T_map_body * Pose3{so3_exp({0, 0, 0.1}), {1, 2, 3}};
  EXPECT_EQ(linked(scene.choose("skeleton")), before);
}

}  // namespace policy_test
}  // namespace tutti::consistency
