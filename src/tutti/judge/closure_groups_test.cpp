// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_groups.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tutti/base/random.hpp"

namespace tutti::judge {
namespace closure_groups_test {

/// Two robots with a node a second, the second from index 200 on.
std::vector<MapNode> two_robots() {
  std::vector<MapNode> out;
  for (const std::uint32_t robot : {0U, 1U})
    for (std::uint32_t k = 0; k < 200; ++k)
      out.push_back({.id = {RobotId{robot}, k}, .stamp = Timestamp{std::int64_t{k} * 1'000'000'000}});
  return out;
}

using Groups = std::vector<std::vector<std::size_t>>;

Groups groups_of(const std::vector<std::pair<std::size_t, std::size_t>>& ends) {
  std::vector<PoseGraphEdge> edges;
  for (const auto& [from, to] : ends) edges.push_back({.from = from, .to = to});
  std::vector<std::size_t> closures(edges.size());
  std::iota(closures.begin(), closures.end(), 0U);
  return closure_groups(two_robots(), edges, closures);
}

TEST(ClosureGroups, AreNearAtBothEnds) {
  EXPECT_EQ(groups_of({{10, 100}, {18, 108}, {10, 130}, {60, 100}}), (Groups{{0, 1}, {2}, {3}}));
  EXPECT_EQ(groups_of({{10, 100}, {26, 116}, {18, 108}}), (Groups{{0, 1, 2}})) << "one leads to the next";
  EXPECT_EQ(groups_of({{10, 100}, {10, 300}}), (Groups{{0}, {1}})) << "another robot";
  EXPECT_EQ(groups_of({{10, 100}, {101, 11}}), (Groups{{0, 1}})) << "the other way round";
  EXPECT_TRUE(groups_of({}).empty());
}

TEST(ClosureGroups, TrajectoriesWalkedTogetherAreManyPlaces) {
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  for (std::size_t k = 0; k < 5; ++k) ends.emplace_back(10 + 9 * k, 300 + 9 * k);
  EXPECT_TRUE(groups_of(ends).empty()) << "36 s";
  ends.pop_back();
  EXPECT_EQ(groups_of(ends), (Groups{{0, 1, 2, 3}})) << "27 s";
}

/// By comparing every two.
Groups one_by_one(const std::vector<MapNode>& nodes, const std::vector<PoseGraphEdge>& edges,
                  const GroupLimits& limits) {
  const auto is_near = [&](std::size_t a, std::size_t b, double most_s) {
    const auto [from_a, to_a] = std::minmax(edges[a].from, edges[a].to);
    const auto [from_b, to_b] = std::minmax(edges[b].from, edges[b].to);
    const auto end_is_near = [&](std::size_t x, std::size_t y) {
      return nodes[x].id.chain == nodes[y].id.chain && std::abs(nodes[x].stamp - nodes[y].stamp) <= most_s;
    };
    return end_is_near(from_a, from_b) && end_is_near(to_a, to_b);
  };
  Groups out;
  std::vector<bool> taken(edges.size(), false);
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (taken[first]) continue;
    std::vector<std::size_t> group;
    const auto take = [&](std::size_t e) {
      taken[e] = true;
      group.push_back(e);
    };
    take(first);
    for (std::size_t k = 0; k < group.size(); ++k)
      for (std::size_t e = 0; e < edges.size(); ++e)
        if (!taken[e] && is_near(group[k], e, limits.near_s)) take(e);
    std::ranges::sort(group);
    const bool is_long = std::ranges::any_of(group, [&](std::size_t a) {
      return std::ranges::any_of(group, [&](std::size_t b) { return !is_near(a, b, limits.longest_s); });
    });
    if (group.size() <= limits.most_closures && !is_long) out.push_back(group);
  }
  return out;
}

TEST(ClosureGroups, AreThoseOfEveryTwoCompared) {
  const std::vector<MapNode> nodes = two_robots();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    std::vector<PoseGraphEdge> edges(1 + rng.index(150));
    std::vector<std::size_t> closures(edges.size());
    std::iota(closures.begin(), closures.end(), 0U);
    for (PoseGraphEdge& edge : edges) edge.from = rng.index(nodes.size()), edge.to = rng.index(nodes.size());
    for (const GroupLimits& limits :
         {GroupLimits{}, GroupLimits{0.0, 30.0, 24}, GroupLimits{15.0, std::numeric_limits<double>::infinity(), 1000},
          GroupLimits{std::numeric_limits<double>::infinity(), 150.0, 1000}})
      EXPECT_EQ(closure_groups(nodes, edges, closures, limits), one_by_one(nodes, edges, limits)) << seed;
  }
}

TEST(ClosureGroups, OnlyTheNamedEdgesCount) {
  const std::vector<PoseGraphEdge> edges = {{.from = 0, .to = 1}, {.from = 10, .to = 100}, {.from = 12, .to = 101}};
  EXPECT_EQ(closure_groups(two_robots(), edges, std::vector<std::size_t>{2}), (Groups{{2}}));
}

}  // namespace closure_groups_test
}  // namespace tutti::judge
