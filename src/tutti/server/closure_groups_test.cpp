// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/closure_groups.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace tutti::server {
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

TEST(ClosureGroups, WaysWalkedTogetherAreManyPlaces) {
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  for (std::size_t k = 0; k < 5; ++k) ends.emplace_back(10 + 9 * k, 300 + 9 * k);
  EXPECT_TRUE(groups_of(ends).empty()) << "36 s";
  ends.pop_back();
  EXPECT_EQ(groups_of(ends), (Groups{{0, 1, 2, 3}})) << "27 s";
}

TEST(ClosureGroups, OnlyTheNamedEdgesCount) {
  const std::vector<PoseGraphEdge> edges = {{.from = 0, .to = 1}, {.from = 10, .to = 100}, {.from = 12, .to = 101}};
  EXPECT_EQ(closure_groups(two_robots(), edges, std::vector<std::size_t>{2}), (Groups{{2}}));
}

}  // namespace closure_groups_test
}  // namespace tutti::server
