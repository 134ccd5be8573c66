// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/proxy_graph_builder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "support/consistency/runs.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"

namespace tutti::consistency {
namespace proxy_graph_builder_test {

using test::kAlpha, test::kBravo;

std::vector<ServerNode> two_robots(std::size_t alpha, std::size_t bravo) {
  auto nodes = test::server_nodes(kAlpha, test::corridor(alpha));
  const auto more = test::server_nodes(kBravo, test::corridor(bravo));
  nodes.insert(nodes.end(), more.begin(), more.end());
  return nodes;
}

std::size_t nodes_of(const ProxyGraph& graph, RobotId robot) {
  return static_cast<std::size_t>(std::count_if(graph.nodes.begin(), graph.nodes.end(),
                                                [&](const ProxyNode& n) { return n.chain.robot == robot; }));
}

TEST(ProxyGraphBuilder, EmptyAndSingle) {
  EXPECT_TRUE(build_proxy_graph(3, {}, {}, {.node_budget = 5}).nodes.empty());
  const auto one = build_proxy_graph(3, test::server_nodes(kAlpha, {Pose3{}}), {{kAlpha, 0}}, {.node_budget = 5});
  ASSERT_EQ(one.nodes.size(), 1U);
  EXPECT_EQ(one.revision, 3U);
  EXPECT_FALSE(one.reduced);
  EXPECT_TRUE(one.nodes[0].covariance.isZero());
}

RC_GTEST_PROP(ProxyGraphBuilder, OrderOfTheNodesDoesNotMatter, (std::uint64_t seed, bool reduce)) {
  auto nodes = two_robots(60, 30);
  const ProxyGraphConfig config{.node_budget = reduce ? 40 : 0};
  const auto expected = build_proxy_graph(1, nodes, {{kAlpha, 0}, {kBravo, 0}}, config);
  Rng rng(seed);
  for (std::size_t i = nodes.size(); i > 1; --i) std::swap(nodes[i - 1], nodes[rng.index(i)]);
  RC_ASSERT(build_proxy_graph(1, nodes, {{kBravo, 0}, {kAlpha, 0}}, config) == expected);
}

RC_GTEST_PROP(ProxyGraphBuilder, MeetsTheBudgetAndKeepsTheEnds, ()) {
  const auto alpha = *rc::gen::inRange<std::size_t>(1, 90), bravo = *rc::gen::inRange<std::size_t>(1, 90);
  const auto budget = *rc::gen::inRange<int>(4, 200);
  const auto nodes = two_robots(alpha, bravo);
  const auto graph = build_proxy_graph(1, nodes, {}, {.node_budget = budget});
  const std::size_t expected = std::min<std::size_t>(static_cast<std::size_t>(budget), alpha + bravo);
  RC_ASSERT(graph.nodes.size() == expected);
  RC_ASSERT(graph.nodes.size() + graph.eliminated.size() == alpha + bravo);
  RC_ASSERT(graph.reduced == (alpha + bravo > static_cast<std::size_t>(budget)));
  for (const RobotId robot : {kAlpha, kBravo}) {
    const std::size_t all = robot == kAlpha ? alpha : bravo, kept = nodes_of(graph, robot);
    RC_ASSERT(kept >= std::min<std::size_t>(2, all));
    // In proportion, but for rounding and the two ends that everybody keeps.
    RC_ASSERT(static_cast<double>(kept) <=
              static_cast<double>(expected * all) / static_cast<double>(alpha + bravo) + 2);
    for (const std::size_t end : {std::size_t{0}, all - 1})
      RC_ASSERT(std::any_of(graph.nodes.begin(), graph.nodes.end(), [&](const ProxyNode& n) {
        return n.chain.robot == robot && n.stamp == test::stamp_of(end);
      }));
  }
}

TEST(ProxyGraphBuilder, TheEndsOfManySmallRobotsComeOutOfTheLargeShares) {
  auto nodes = two_robots(100, 2);
  for (const std::uint32_t robot : {11U, 12U, 13U})
    for (const ServerNode& node : test::server_nodes(RobotId{robot}, {Pose3{}, Pose3{{1, 0, 0, 0}, {1, 0, 0}}}))
      nodes.push_back(node);
  const auto graph = build_proxy_graph(1, nodes, {}, {.node_budget = 12});
  EXPECT_EQ(graph.nodes.size(), 12U);
  EXPECT_EQ(nodes_of(graph, kAlpha), 4U);
  EXPECT_EQ(build_proxy_graph(1, nodes, {}, {.node_budget = 5}).nodes.size(), 10U);  // the ends alone
}

TEST(ProxyGraphBuilder, EdgesStayWithinARobotAndArePositive) {
  const auto graph = build_proxy_graph(1, two_robots(80, 60), {}, {.node_budget = 70});
  ASSERT_TRUE(graph.reduced);
  ASSERT_FALSE(graph.edges.empty());
  for (const ProxyEdge& edge : graph.edges) {
    EXPECT_LT(edge.a, edge.b);
    ASSERT_LT(edge.b, graph.nodes.size());
    EXPECT_EQ(graph.nodes[edge.a].chain, graph.nodes[edge.b].chain);
    EXPECT_GT(edge.weight, 0.0);
  }
}

TEST(ProxyGraphBuilder, ReductionCompoundsCovariance) {
  auto nodes = test::server_nodes(kAlpha, test::corridor(40));
  const auto graph = build_proxy_graph(1, nodes, {}, {.node_budget = 8});
  ASSERT_EQ(graph.nodes.size(), 8U);
  std::size_t previous = 0;
  for (std::size_t k = 1; k < graph.nodes.size(); ++k) {
    const auto index =
        static_cast<std::size_t>(std::lround((graph.nodes[k].stamp - nodes[0].stamp) / test::kNodePeriod_s));
    Matrix6d expected = Matrix6d::Zero();
    for (std::size_t i = previous + 1; i <= index; ++i)
      expected = compound_covariance(nodes[i - 1].T_world_body.inverse() * nodes[i].T_world_body, expected,
                                     nodes[i].covariance);
    EXPECT_LT((graph.nodes[k].covariance - expected).norm(), 1e-15);
    previous = index;
  }
}

TEST(ProxyGraphBuilder, ThePapersReducerKeepsTheEndsToo) {
  const auto graph = build_proxy_graph(1, two_robots(80, 60), {}, {.node_budget = 70, .reducer = "paper"});
  EXPECT_TRUE(graph.reduced);
  EXPECT_FALSE(graph.eliminated.empty());
  for (const RobotId robot : {kAlpha, kBravo})
    EXPECT_TRUE(std::any_of(graph.nodes.begin(), graph.nodes.end(), [&](const ProxyNode& n) {
      return n.chain.robot == robot && n.stamp == test::stamp_of(robot == kAlpha ? 79 : 59);
    }));
}

TEST(ProxyGraphBuilder, ARepeatedStampIsOurOwnMistake) {
  auto nodes = test::server_nodes(kAlpha, test::corridor(3));
  nodes[2].stamp = nodes[1].stamp;
  EXPECT_THROW(build_proxy_graph(1, nodes, {}, {}), std::logic_error);
}

/// Up to four robots with up to two sessions each, in two components, with or without reduction.
ProxyGraph any_graph() {
  std::vector<ServerNode> nodes;
  std::vector<ChainComponent> components;
  const auto robots = *rc::gen::inRange<std::uint32_t>(1, 5);
  for (std::uint32_t robot = 0; robot < robots; ++robot)
    for (std::uint64_t session = 0; session < *rc::gen::inRange<std::uint64_t>(1, 3); ++session) {
      auto more = test::server_nodes(RobotId{robot}, test::corridor(*rc::gen::inRange<std::size_t>(1, 40)));
      for (ServerNode& node : more) node.chain.session = session;
      nodes.insert(nodes.end(), more.begin(), more.end());
      components.push_back({more.front().chain, *rc::gen::inRange<std::uint32_t>(0, 2)});
    }
  ProxyGraph graph = build_proxy_graph(7, nodes, components, {.node_budget = *rc::gen::element(0, 30)});
  graph.epoch = 3;
  for (LastSeen& seen : graph.last_seen) seen.name = "robot-" + std::to_string(seen.chain.robot.value);
  for (const ChainComponent& entry : components)
    graph.uncertainties.push_back(
        even_uncertainty(entry.chain, tutti::nodes_of(graph, entry.chain).size(), {0.1, 0.01}));
  return graph;
}

RC_GTEST_PROP(ProxyGraphBuilder, ARobotIsLastSeenAtTheEndOfItsNewestChain, ()) {
  const ProxyGraph graph = any_graph();
  for (const ProxyNode& node : graph.nodes) {
    const auto seen = std::ranges::find(graph.last_seen, node.chain.robot, [](const auto& s) { return s.chain.robot; });
    RC_ASSERT(seen != graph.last_seen.end());
    RC_ASSERT(std::pair(node.chain, node.stamp) <= std::pair(seen->chain, seen->stamp));
    RC_ASSERT(std::pair(node.chain, node.stamp) != std::pair(seen->chain, seen->stamp) ||
              node.T_world_body == seen->T_world_body);
  }
  RC_ASSERT(std::ranges::adjacent_find(graph.last_seen, [](const auto& a, const auto& b) {
              return a.chain.robot >= b.chain.robot;
            }) == graph.last_seen.end());
}

RC_GTEST_PROP(OwnPart, IsAllOfTheNewestChainAndWhereTheOthersOfItsMapAre, ()) {
  const ProxyGraph whole = any_graph();
  for (const LastSeen& self : whole.last_seen) {
    const ProxyGraph own = own_part(whole, self.chain.robot);
    RC_ASSERT(own.age() == whole.age());
    RC_ASSERT(own.reduced == whole.reduced);
    RC_ASSERT(std::ranges::equal(own.nodes, tutti::nodes_of(whole, self.chain)));
    const auto of_chain = [&](const auto& value) { return value.chain == self.chain; };
    RC_ASSERT(std::ranges::all_of(own.eliminated, of_chain));
    RC_ASSERT(std::ranges::count_if(whole.eliminated, of_chain) == std::ssize(own.eliminated));
    RC_ASSERT(own.uncertainties.size() == 1U);
    RC_ASSERT(own.uncertainties[0] == *uncertainty_of(whole, self.chain));
    auto edge = own.edges.begin();
    for (const ProxyEdge& of_whole : whole.edges) {
      if (!of_chain(whole.nodes[of_whole.a])) continue;
      RC_ASSERT(edge != own.edges.end());
      RC_ASSERT(own.nodes.at(edge->a) == whole.nodes[of_whole.a]);
      RC_ASSERT(own.nodes.at(edge->b) == whole.nodes[of_whole.b]);
      RC_ASSERT(edge->weight == of_whole.weight);
      ++edge;
    }
    RC_ASSERT(edge == own.edges.end());
    std::vector<LastSeen> others;
    std::vector<ChainComponent> components;
    for (const LastSeen& other : whole.last_seen) {
      if (component_of(whole, other.chain) != component_of(whole, self.chain)) continue;
      if (other != self) others.push_back(other);
      components.push_back({other.chain, *component_of(whole, self.chain)});
    }
    RC_ASSERT(own.last_seen == others);
    RC_ASSERT(own.components == components);
  }
}

TEST(OwnPart, OfARobotWithoutNodesIsEmpty) {
  const ProxyGraph whole = build_proxy_graph(3, two_robots(5, 5), {{kAlpha, 0}, {kBravo, 0}}, {.radius_m = 6.0});
  const ProxyGraph own = own_part(whole, RobotId{kBravo.value + 1});
  EXPECT_EQ(own, (ProxyGraph{.revision = 3, .radius_m = 6.0}));
}

}  // namespace proxy_graph_builder_test
}  // namespace tutti::consistency
