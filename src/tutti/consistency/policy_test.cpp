// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/policy.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "support/consistency/runs.hpp"
#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency {
namespace policy_test {

using test::kAlpha;
using Pairs = std::set<std::pair<std::size_t, std::size_t>>;  // of nodes

struct Scene {
  explicit Scene(std::size_t length)
      : graph(test::proxy_graph(test::corridor(length))), nodes(test::robot_nodes(test::corridor(length))) {
    for (std::size_t n = 0; n < length; ++n) pairs.push_back({n, n});
    disagreement = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(length), 7);
  }
  [[nodiscard]] PolicyInput input() const { return {graph, kAlpha, nodes, pairs, ledger}; }
  [[nodiscard]] Selection choose(const char* policy) const {
    return (*make_policy({.name = policy}, {}))->choose(input());
  }
  /// The selection by `spectral` from a disagreement that is set by hand.
  [[nodiscard]] Selection spectral(const PolicyConfig& config) const {
    return internal::links_where(input(), disagreement, config);
  }
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
  std::vector<NodePair> pairs;
  Eigen::MatrixXd disagreement;
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
  const auto policy = make_policy({.name = "oracle"}, {});
  ASSERT_FALSE(policy.has_value());
  EXPECT_EQ(policy.error().code, ErrorCode::configuration);
}

TEST(Policy, EveryRowIsMadeByItsName) {
  for (const PolicyKind& kind : policies()) {
    EXPECT_TRUE(make_policy({.name = std::string(kind.name)}, {}).has_value()) << kind.name;
    EXPECT_NE(make_policy({.name = "oracle"}, {}).error().message.find(kind.name), std::string::npos) << kind.name;
  }
}

TEST(Policy, ZeroOrOneNodeGivesNothingAndTakesNothingAway) {
  for (const std::size_t length : {0U, 1U}) {
    Scene scene(length);
    scene.disagreement.setConstant(10.0);
    for (const Selection& selection :
         {scene.choose("none"), scene.choose("every_node"), scene.choose("spectral"), scene.spectral({})}) {
      EXPECT_TRUE(selection.constraints.empty());
      EXPECT_FALSE(selection.replaces_all);
    }
  }
}

TEST(Policy, EveryLinkIsMeasuredOnTheServersMap) {
  Scene scene(60);
  scene.disagreement.setConstant(1.0);
  for (RobotNode& node : scene.nodes) node.T_map_body.translation *= 1.5;
  for (const Selection& selection : {scene.choose("every_node"), scene.choose("spectral"), scene.spectral({})}) {
    EXPECT_FALSE(selection.constraints.empty());
    for (const Constraint& c : selection.constraints) {
      const Pose3 expected =
          scene.graph.nodes[c.from / 3].T_world_body.inverse() * scene.graph.nodes[c.to / 3].T_world_body;
      EXPECT_LT(local(c.measurement.T_a_b, expected).norm(), 1e-10);
      EXPECT_LT(c.from_stamp, c.to_stamp);
    }
  }
}

TEST(EveryNode, LinksNeighboursInTime) {
  Scene scene(5);
  EXPECT_EQ(linked(scene.choose("every_node")), (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4}}));
  EXPECT_TRUE(scene.choose("every_node").replaces_all);
}

TEST(Spectral, LinksWhereItsComparisonDemandsIt) {
  Scene scene(60);
  for (std::size_t n = 30; n < 60; ++n) scene.nodes[n].T_map_body.translation.y() += 2.0;
  const CompareConfig compare_config;
  const auto policy = make_policy({.name = "spectral"}, compare_config);
  const Comparison comparison = compare(scene.graph, kAlpha, scene.nodes, compare_config);
  const Selection selection = (*policy)->choose(scene.input());
  EXPECT_FALSE(selection.constraints.empty());
  EXPECT_EQ(selection.constraints, internal::links_where(scene.input(), comparison.disagreement, {}).constraints);
  EXPECT_EQ(selection.order, comparison.order);
  EXPECT_GT(selection.order, 0);
}

TEST(Spectral, NothingBelowTheThresholds) {
  Scene scene(50);
  EXPECT_TRUE(scene.spectral(kConfig).constraints.empty());
  EXPECT_FALSE(scene.spectral(kConfig).replaces_all);
}

TEST(Spectral, AGroupsDisagreementIsTheSumOverItsScales) {
  Scene scene(50);
  scene.disagreement.row(20).segment(4, 3).setConstant(0.09);  // 0.27
  EXPECT_TRUE(scene.spectral(kConfig).constraints.empty());
  scene.disagreement.row(20).segment(4, 3).setConstant(0.11);  // 0.33
  EXPECT_EQ(linked(scene.spectral(kConfig)), (Pairs{{19, 20}, {20, 21}}));
}

TEST(Spectral, SmallMidAndLargeScalesAskForTheirLinks) {
  Scene scene(50);
  auto& d = scene.disagreement;
  d(10, 5) = 0.4;
  d(20, 3) = 0.5;
  d(31, 1) = 0.6;
  const auto selection = scene.spectral(kConfig);
  EXPECT_EQ(linked(selection, ConstraintKind::small), (Pairs{{9, 10}, {10, 11}}));
  EXPECT_EQ(linked(selection, ConstraintKind::mid), (Pairs{{15, 20}, {20, 25}}));
  // Node 31 is at 93 s, in submap 9 (90-100 s, first node 30). Straight corridor: the nearest centroids are those of
  // submaps 8, 7, 10, 11; their first nodes are at 81, 72, 102 and 111 s.
  EXPECT_EQ(linked(selection, ConstraintKind::large), (Pairs{{27, 30}, {24, 30}, {30, 34}, {30, 37}}));
}

TEST(Spectral, LargeLinksJumpToARevisitedPlace) {
  Scene scene(330);  // corridor() is back at (0, 0), where it began, after 320 m
  scene.disagreement(316, 0) = 1.0;
  const auto links = linked(scene.spectral(kConfig), ConstraintKind::large);
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
  scene.disagreement.row(0).setConstant(1.0);
  const auto selection = scene.spectral(kConfig);
  EXPECT_EQ(linked(selection, ConstraintKind::small), (Pairs{{0, 1}}));
  EXPECT_TRUE(linked(selection, ConstraintKind::mid).empty());
}

TEST(Spectral, TheLargestExcessComesFirstAndGroupsTakeTurns) {
  Scene scene(60);
  auto& d = scene.disagreement;
  d(10, 5) = 0.4;   // small, 1.33 x
  d(40, 6) = 3.0;   // small, 10 x
  d(20, 2) = 0.44;  // mid, 1.1 x
  const Selection selection = scene.spectral(kConfig);
  std::vector<std::pair<std::size_t, std::size_t>> in_order;
  for (const Constraint& c : selection.constraints) in_order.emplace_back(c.from / 3, c.to / 3);
  EXPECT_EQ(in_order, (std::vector<std::pair<std::size_t, std::size_t>>{
                          {15, 20}, {20, 25}, {39, 40}, {40, 41}, {9, 10}, {10, 11}}));
}

TEST(Spectral, TopTakesTheLargestOverAllGroups) {
  Scene scene(60);
  auto& d = scene.disagreement;
  for (Eigen::Index n = 0; n < 60; ++n) d(n, 5) = 0.08;
  d(30, 2) = 0.3;
  d(44, 4) = 0.2;
  d(7, 0) = 0.06;
  PolicyConfig config{.classifier = "top", .top_count = 2};
  EXPECT_EQ(linked(scene.spectral(config)), (Pairs{{25, 30}, {30, 35}, {43, 44}, {44, 45}}));
  config.top_count = 10;
  EXPECT_EQ(linked(scene.spectral(config), ConstraintKind::small).size(), 2U + 8U);  // 44 and 0, 1, .. 7
  config.top_threshold_m = 0.29;
  EXPECT_EQ(linked(scene.spectral(config)), (Pairs{{25, 30}, {30, 35}}));
}

TEST(Spectral, MeasuresKeptConstraintsAgain) {
  Scene scene(60);
  scene.disagreement(10, 5) = 1.0;
  scene.ledger.update(scene.spectral(kConfig).constraints, false);
  ASSERT_EQ(scene.ledger.size(), 2U);
  scene.disagreement.setZero();
  scene.disagreement(30, 5) = 1.0;
  scene.graph.revision = 2;
  scene.graph.nodes[11].T_world_body.translation.z() += 0.5;
  const auto selection = scene.spectral(kConfig);
  EXPECT_EQ(linked(selection), (Pairs{{9, 10}, {10, 11}, {29, 30}, {30, 31}}));
  const auto update = scene.ledger.update(selection.constraints, selection.replaces_all);
  EXPECT_EQ(update.added, 2U);
  EXPECT_EQ(update.replaced, 1U);
  EXPECT_EQ(update.unchanged, 1U);
}

}  // namespace policy_test
}  // namespace tutti::consistency
