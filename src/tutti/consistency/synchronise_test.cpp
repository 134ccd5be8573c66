// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/synchronise.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "support/consistency/runs.hpp"

namespace tutti::consistency {
namespace synchronise_test {

using test::kAlpha, test::kBravo;

ProxyGraph graph_with(const std::vector<std::pair<RobotId, std::int64_t>>& stamps) {
  ProxyGraph graph;
  for (const auto& [robot, ns] : stamps) graph.nodes.push_back({.chain = robot, .stamp = {ns}});
  return graph;
}

std::vector<RobotNode> nodes_with(const std::vector<std::int64_t>& stamps) {
  std::vector<RobotNode> nodes;
  for (const std::int64_t ns : stamps) nodes.push_back({.stamp = {ns}});
  return nodes;
}

TEST(Synchronise, MatchesEqualStampsOfTheOwnRobotOnly) {
  const auto graph = graph_with({{kAlpha, 10}, {kAlpha, 20}, {kAlpha, 40}, {kBravo, 10}, {kBravo, 30}});
  const auto sync = synchronise(graph, kAlpha, nodes_with({10, 30, 40, 50}));
  EXPECT_EQ(sync.pairs, (std::vector<NodePair>{{0, 0}, {2, 2}}));
}

TEST(Synchronise, NothingOnEitherSide) {
  EXPECT_TRUE(synchronise({}, kAlpha, {}).pairs.empty());
  EXPECT_TRUE(synchronise(graph_with({{kAlpha, 1}}), kAlpha, {}).pairs.empty());
  EXPECT_TRUE(synchronise({}, kAlpha, nodes_with({1})).pairs.empty());
}

TEST(Synchronise, SortsEliminatedNodesFromUnknownOnes) {
  auto graph = graph_with({{kAlpha, 10}, {kAlpha, 40}});
  graph.eliminated = {{kAlpha, {20}}, {kAlpha, {30}}, {kBravo, {25}}};
  const auto sync = synchronise(graph, kAlpha, nodes_with({10, 20, 25, 40, 50}));
  EXPECT_EQ(sync.pairs, (std::vector<NodePair>{{0, 0}, {1, 3}}));
  EXPECT_EQ(sync.eliminated, (std::vector<std::size_t>{1}));  // 30 is not ours, 25 is bravo's, 50 is new
}

RC_GTEST_PROP(Synchronise, IsOneToOneChronologicalAndComplete, ()) {
  // Few different stamps, so gaps and duplicates are common.
  const auto theirs = *rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(0, 12));
  auto ours = *rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(0, 12));
  std::sort(ours.begin(), ours.end());
  std::vector<std::pair<RobotId, std::int64_t>> stamps;
  std::map<std::int64_t, std::size_t> count_theirs, count_ours;
  for (const std::int64_t ns : theirs) stamps.emplace_back(kAlpha, ns), ++count_theirs[ns];
  for (const std::int64_t ns : ours) ++count_ours[ns];
  std::size_t expected = 0;
  for (const auto& [ns, count] : count_theirs) expected += std::min(count, count_ours[ns]);

  const auto graph = graph_with(stamps);
  const auto nodes = nodes_with(ours);
  const auto sync = synchronise(graph, kAlpha, nodes);
  std::set<std::size_t> proxies, robots;
  Timestamp last{-1};
  for (const NodePair& pair : sync.pairs) {
    RC_ASSERT(graph.nodes[pair.proxy].stamp == nodes[pair.robot].stamp);
    RC_ASSERT(last <= nodes[pair.robot].stamp);
    last = nodes[pair.robot].stamp;
    RC_ASSERT(proxies.insert(pair.proxy).second);
    RC_ASSERT(robots.insert(pair.robot).second);
  }
  RC_ASSERT(sync.pairs.size() == expected);
}

}  // namespace synchronise_test
}  // namespace tutti::consistency
