// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_monitor.hpp"

#include <gtest/gtest.h>

#include "tutti/server/testing/world.hpp"

namespace tutti::server {
namespace {

/// Two robots with nodes 0..9 each, all representative, in one component.
MapEstimate two_chains() {
  MapEstimate map;
  for (std::uint32_t r = 0; r < 2; ++r)
    for (std::uint32_t k = 0; k < 10; ++k)
      map.nodes.push_back({.id = {{r}, k}, .stamp = {k}, .representative = true, .component = 0});
  return map;
}

JudgedClosure closure(std::uint32_t ra, std::uint32_t a, std::uint32_t rb, std::uint32_t b, bool accepted = true) {
  return {{{RobotId{ra}, a}, {RobotId{rb}, b}, {}}, accepted};
}

const std::vector<std::size_t> kFirstRobot{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

TEST(ClosureSupport, CountsTheClosuresThatSpanAStretch) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 2, 0, 6), closure(0, 4, 0, 8), closure(0, 1, 0, 9, false)};
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 2, 2, 1, 1, 0}));
}

TEST(ClosureSupport, ClosuresWithAnotherRobotSupportWhatLiesBetweenThem) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 2, 1, 3)};
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>(10, 0)));  // one alone makes no cycle
  map.closures.push_back(closure(0, 7, 1, 8));
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 1, 1, 1, 0, 0}));
}

TEST(ClosureSupport, FollowsTheChosenNodesOnly) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 3, 0, 6)};
  // Only what lies wholly between the closure's ends is supported by it.
  EXPECT_EQ(closure_support(map, {0, 4, 5, 9}), (std::vector<std::uint32_t>{0, 0, 1, 0}));
  EXPECT_EQ(closure_support(map, {0, 3, 6, 9}), (std::vector<std::uint32_t>{0, 0, 1, 0}));
  EXPECT_TRUE(closure_support(map, {}).empty());
}

TEST(MonitorGraph, SaysLessWhereClosuresHelp) {
  const test::TestFinder finder(1);
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  VerdictSet verdicts;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (finder.is_candidate(*a->second, *b->second))
        verdicts[{a->first, b->first}] = *finder.verify(*a->second, *b->second, MemoryCloudStore());
  ASSERT_GT(verdicts.size(), 2U);
  const ProxyGraph without = monitor_graph(estimate_map(submaps, {}, {}), 1, {});
  const ProxyGraph with = monitor_graph(estimate_map(submaps, verdicts, {}), 2, {});
  ASSERT_EQ(with.nodes.size(), without.nodes.size());
  EXPECT_TRUE(with.nodes.front().covariance.isZero());
  std::size_t supported = 0;
  for (std::size_t k = 1; k < with.nodes.size(); ++k) {
    EXPECT_EQ(without.nodes[k].support, 0U);
    // Two odometry steps without closures; never more uncertain with them.
    EXPECT_NEAR(without.nodes[k].covariance(3, 3), 2 * 0.005 * 0.005, 1e-7);
    EXPECT_LE(with.nodes[k].covariance.trace(), without.nodes[k].covariance.trace() * (1 + 1e-6));
    if (with.nodes[k].support == 0) continue;
    ++supported;
    EXPECT_LT(with.nodes[k].covariance.trace(), without.nodes[k].covariance.trace());
  }
  EXPECT_GT(supported, 20U);
}

}  // namespace
}  // namespace tutti::server
