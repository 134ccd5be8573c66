// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/chain_reduction.hpp"

#include <gtest/gtest.h>

#include "support/estimation/random_graphs.hpp"

namespace tutti::estimation {
namespace chain_reduction_test {

using namespace testing;

/// Odometry of 60 poses and a few loops.
struct Scene {
  PoseGraph graph;
  std::vector<EdgeRole> roles;
};
Scene scene(std::uint64_t seed) {
  Rng rng(seed);
  Scene out{random_graph(rng, 60, 6, 0.2, 0.01, 0.003).graph, {}};
  out.roles.assign(out.graph.edges.size(), EdgeRole::robust);
  std::fill_n(out.roles.begin(), 59, EdgeRole::trusted);
  return out;
}

TEST(ChainReduction, KeepsTheEndsOfChainsAndWhatRobustEdgesTouch) {
  const Scene s = scene(1);
  const ReducedGraph reduced = reduce_chains(s.graph, s.roles);
  EXPECT_EQ(reduced.nodes.front(), 0U);
  EXPECT_EQ(reduced.nodes.back(), 59U);
  EXPECT_LE(reduced.nodes.size(), 2U + 12U);
  std::size_t kept = 0;
  for (std::size_t e = 0; e < s.graph.edges.size(); ++e) {
    if (s.roles[e] == EdgeRole::trusted) continue;
    ASSERT_TRUE(reduced.edge[e].has_value());
    const PoseGraphEdge& edge = reduced.graph.edges[*reduced.edge[e]];
    EXPECT_EQ(reduced.nodes[edge.from], s.graph.edges[e].from);
    EXPECT_EQ(reduced.nodes[edge.to], s.graph.edges[e].to);
    EXPECT_EQ(reduced.roles[*reduced.edge[e]], EdgeRole::robust);
    ++kept;
  }
  EXPECT_EQ(kept, s.graph.edges.size() - 59U);
}

TEST(ChainReduction, HasTheOptimumOfTheFullGraph) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Scene s = scene(seed);
    const auto full = solve_pose_graph(s.graph, {}, s.roles);
    const ReducedGraph reduced = reduce_chains(s.graph, s.roles);
    const auto small = solve_pose_graph(reduced.graph, {}, reduced.roles);
    std::vector<Pose3> poses = s.graph.poses;
    expand_chains(s.graph, reduced, small.poses, poses);
    // To first order; the loops bend these chains by centimetres.
    EXPECT_LT(largest_position_difference(poses, full.poses), 5e-3) << seed;
    EXPECT_NEAR(small.summary.final_cost, full.summary.final_cost, 0.02 * full.summary.final_cost + 0.1) << seed;
  }
}

TEST(ChainReduction, CompoundsNothingWithoutTrustedEdges) {
  const Scene s = scene(2);
  const ReducedGraph reduced = reduce_chains(s.graph, {});
  EXPECT_TRUE(reduced.runs.empty());
  EXPECT_EQ(reduced.nodes.size(), s.graph.poses.size());
  EXPECT_EQ(reduced.graph.edges.size(), s.graph.edges.size());
}

}  // namespace chain_reduction_test
}  // namespace tutti::estimation
