// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/fixed_nodes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/estimation/random_graphs.hpp"

namespace tutti::estimation {
namespace fixed_nodes_test {

using namespace testing;

/// A noisy graph, its fixed nodes moved away from where the edges would have them, by either solver.
class FixedNodes : public ::testing::TestWithParam<bool> {
 protected:
  static PoseGraphSolution solve(const PoseGraph& graph, std::span<const std::size_t> fixed) {
    const SolverConfig tight{.relative_cost_tolerance = 1e-14};
    if (!GetParam()) return solve_pose_graph(graph, tight, {}, fixed);
    return solve_pose_graph_gnc(graph, {.solver = tight, .confidence = 0.999999999}, roles_from_numbering(graph), fixed)
        .solution;
  }
};

TEST_P(FixedNodes, AStoppedSolutionIsWhatIsThere) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 60, 60, 1.0).graph;
  const auto roles = roles_from_numbering(graph);
  const auto stopped_after = [&](int steps) {
    const auto stop = [&] { return steps-- <= 0; };
    const SolverConfig given{.relative_cost_tolerance = 1e-14, .initialisation = "given"};
    return GetParam() ? solve_pose_graph_gnc(graph, {.solver = given}, roles, {}, stop).solution
                      : solve_pose_graph(graph, given, roles, {}, stop);
  };
  const auto none = stopped_after(0), whole = stopped_after(1'000'000);
  EXPECT_EQ(whole.summary.termination, Termination::converged);
  EXPECT_EQ(none.summary.iterations, 0);
  for (const auto& solution : {none, stopped_after(1)}) {
    EXPECT_EQ(solution.summary.termination, Termination::max_iterations);
    EXPECT_TRUE(is_usable(solution.summary.termination));
    EXPECT_GE(solution.summary.final_cost, whole.summary.final_cost);
    EXPECT_EQ(solution.poses.size(), graph.poses.size());
  }
}

TEST_P(FixedNodes, StayAndTheOthersAreOptimal) {
  const std::vector<std::size_t> fixed = {7, 20, 21};  // not the first; 20 and 21 share an edge
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    PoseGraph graph = random_graph(rng, 40, 15, 1.0).graph;
    for (const std::size_t i : fixed) graph.poses[i] = graph.poses[i] * random_pose(rng, 0.01, 0.003);
    const auto solution = solve(graph, fixed);
    ASSERT_TRUE(is_usable(solution.summary.termination)) << to_string(solution.summary.termination);
    for (const std::size_t i : fixed) EXPECT_EQ(solution.poses[i], graph.poses[i]) << i;
    EXPECT_NE(solution.poses[0], graph.poses[0]) << "the first node is free when others are fixed";
    ASSERT_EQ(*std::ranges::min_element(solution.weights), 1.0) << "gnc has nothing to reject";
    graph.poses = solution.poses;
    const double least = chi2(graph);
    for (std::size_t i = 0; i < graph.poses.size(); ++i) {
      if (std::ranges::find(fixed, i) != fixed.end()) continue;
      const Pose3 pose = graph.poses[i];
      for (int k = 0; k < 12; ++k) {
        Vector6d step = Vector6d::Zero();
        step(k % 6) = k < 6 ? 1e-3 : -1e-3;
        graph.poses[i] = retract(pose, step);
        EXPECT_GT(chi2(graph), least) << i;
      }
      graph.poses[i] = pose;
    }
  }
}

TEST_P(FixedNodes, HoldOnlyTheirOwnComponent) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 10, 5, 1.0).graph;
  const PoseGraph other = random_graph(rng, 10, 5, 1.0).graph;
  for (const auto& [from, to, T, information] : other.edges)
    graph.edges.push_back({from + 10, to + 10, T, information});
  graph.poses.insert(graph.poses.end(), other.poses.begin(), other.poses.end());
  const auto solution = solve(graph, std::vector<std::size_t>{4});
  EXPECT_EQ(solution.poses[4], graph.poses[4]);
  EXPECT_NE(solution.poses[0], graph.poses[0]);
  EXPECT_EQ(solution.poses[10], graph.poses[10]) << "the first of a component without a fixed node";
}

TEST_P(FixedNodes, MayBeAll) {
  Rng rng(4);
  const PoseGraph graph = random_graph(rng, 4, 2, 1.0).graph;
  const auto solution = solve(graph, std::vector<std::size_t>{0, 1, 2, 3});
  EXPECT_TRUE(is_usable(solution.summary.termination));
  EXPECT_EQ(solution.poses, graph.poses);
}

INSTANTIATE_TEST_SUITE_P(BothSolvers, FixedNodes, ::testing::Bool());

}  // namespace fixed_nodes_test
}  // namespace tutti::estimation
