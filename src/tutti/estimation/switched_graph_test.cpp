// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/switched_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/estimation/random_graphs.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace switched_graph_test {

using namespace testing;

constexpr SolverConfig kPrecise{.relative_cost_tolerance = 1e-13};

std::vector<EdgeRole> chain_is_trusted(const PoseGraph& graph) {
  std::vector<EdgeRole> out(graph.edges.size(), EdgeRole::robust);
  for (std::size_t e = 0; e + 1 < graph.poses.size(); ++e) out[e] = EdgeRole::trusted;
  return out;
}

TEST(SwitchedGraph, APriceIsWhatTheMapPays) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    const PoseGraph graph = random_graph(rng, 30, 6, 0.02).graph;
    SwitchedGraph switched(graph, chain_is_trusted(graph), kPrecise);
    std::vector<char> in(graph.edges.size(), 1);
    ASSERT_TRUE(is_usable(switched.solve(in)));
    const double whole = switched.cost();
    const std::vector<double> prices = switched.prices();
    for (std::size_t e = graph.poses.size() - 1; e < graph.edges.size(); ++e) {
      in[e] = 0;
      ASSERT_TRUE(is_usable(switched.solve(in)));
      const double saved = whole - switched.cost(), would_cost = switched.prices()[e];
      in[e] = 1;
      EXPECT_NEAR(prices[e], saved, 0.05 * saved + 0.05) << seed << " edge " << e;
      EXPECT_NEAR(would_cost, saved, 0.05 * saved + 0.05) << seed << " edge " << e;
    }
  }
}

// Each step of a ring turns 18 degrees too far, so that it goes round twice: no small change of any pose is cheaper.
TEST(SwitchedGraph, FromTheMeasurementsItLeavesABasinThatCostsMore) {
  constexpr int kNodes = 20;
  constexpr double kTurn = 2.0 * M_PI / kNodes;
  PoseGraph ring;
  const Pose3 step{so3_exp({0.0, 0.0, kTurn}), {1.0, 0.0, 0.0}};
  Pose3 T;
  for (std::size_t k = 0; k < kNodes; ++k) {
    ring.poses.push_back(T);
    T = T * step * Pose3{so3_exp({0.0, 0.0, kTurn}), Eigen::Vector3d::Zero()};
    ring.edges.push_back({k, (k + 1) % kNodes, step, Matrix6d::Identity()});
  }
  const std::vector<EdgeRole> robust(ring.edges.size(), EdgeRole::robust);
  SolverConfig given = kPrecise;
  given.initialisation = "given";
  SwitchedGraph switched(ring, robust, given);
  ASSERT_TRUE(is_usable(switched.solve(std::vector<char>(ring.edges.size(), 1))));
  EXPECT_GT(switched.cost(), 1.0);
  EXPECT_TRUE(switched.improve_from_measurements());
  EXPECT_NEAR(switched.cost(), 0.0, 1e-9);
  EXPECT_FALSE(switched.improve_from_measurements());  // it is there
}

TEST(SwitchedGraph, TakingInAndOutEndsWhereItBegan) {
  Rng rng(3);
  const PoseGraph graph = random_graph(rng, 25, 5, 0.02).graph;
  SwitchedGraph switched(graph, chain_is_trusted(graph), kPrecise);
  std::vector<char> in(graph.edges.size(), 1);
  ASSERT_TRUE(is_usable(switched.solve(in)));
  const std::vector<Pose3> before = switched.poses();
  in.back() = 0;
  ASSERT_TRUE(is_usable(switched.solve(in)));
  in.back() = 1;
  ASSERT_TRUE(is_usable(switched.solve(in)));
  const std::vector<Pose3> after = switched.poses();
  ASSERT_EQ(after.size(), graph.poses.size());
  for (std::size_t k = 0; k < after.size(); ++k) EXPECT_LT(local(before[k], after[k]).norm(), 1e-6) << k;
}

TEST(SwitchedGraph, FromTheOptimumItTakesOneFactorisationPricesIncluded) {
  Rng rng(4);
  PoseGraph graph = random_graph(rng, 30, 12, 0.02).graph;
  const std::vector<EdgeRole> roles = chain_is_trusted(graph);
  const std::vector<char> in(graph.edges.size(), 1);
  SwitchedGraph first(graph, roles, kPrecise);
  ASSERT_TRUE(is_usable(first.solve(in)));
  const std::vector<double> expected = first.prices();
  graph.poses = first.poses();
  SolverConfig from_there = kPrecise;
  from_there.initialisation = "given";
  SwitchedGraph again(graph, roles, from_there);
  ASSERT_TRUE(is_usable(again.solve(in)));
  const std::vector<double> prices = again.prices();
  EXPECT_EQ(again.factorisations(), 1);
  for (std::size_t e = 0; e < prices.size(); ++e) EXPECT_NEAR(prices[e], expected[e], 1e-4 * (1.0 + expected[e])) << e;
  static_cast<void>(again.prices());  // the factor was taken
  EXPECT_EQ(again.factorisations(), 2);
}

TEST(SwitchedGraph, WhatAloneJoinsTwoPartsHasNoPrice) {
  Rng rng(5);
  PoseGraph graph = random_graph(rng, 10, 2, 0.02).graph;
  const std::size_t one = graph.poses.size();
  std::vector<EdgeRole> roles = chain_is_trusted(graph);
  for (int k = 0; k < 3; ++k) graph.poses.push_back(graph.poses[static_cast<std::size_t>(k)]);
  const PoseGraphEdge step = graph.edges.front();
  for (std::size_t k = one; k + 1 < graph.poses.size(); ++k) {
    graph.edges.push_back({k, k + 1, step.T_from_to, step.information});
    roles.push_back(EdgeRole::trusted);
  }
  for (const std::size_t end : {one, one + 2}) {
    graph.edges.push_back({2, end, step.T_from_to, step.information});
    roles.push_back(EdgeRole::robust);
  }
  SwitchedGraph switched(graph, roles, kPrecise);
  std::vector<char> in(graph.edges.size(), 1);
  in.back() = in[in.size() - 2] = 0;
  ASSERT_TRUE(is_usable(switched.solve(in)));
  EXPECT_TRUE(std::isinf(switched.prices().back()));
  in[in.size() - 2] = 1;
  ASSERT_TRUE(is_usable(switched.solve(in)));
  EXPECT_TRUE(std::isfinite(switched.prices().back()));
}

}  // namespace switched_graph_test
}  // namespace tutti::estimation
