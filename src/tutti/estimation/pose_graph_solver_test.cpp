// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/pose_graph_solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "support/estimation/random_graphs.hpp"

extern "C" void openblas_set_num_threads(int threads);

namespace tutti::estimation {
namespace pose_graph_solver_test {

using namespace testing;

const SolverConfig kChordal{.relative_cost_tolerance = 1e-14};
const SolverConfig kGiven{.relative_cost_tolerance = 1e-14, .initialisation = "given"};

/// Truth, but for the first node, forgotten.
PoseGraph forget(PoseGraph graph) {
  std::fill(graph.poses.begin() + 1, graph.poses.end(), Pose3{});
  return graph;
}

TEST(Chordal, IsExactWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    const auto random = random_graph(rng, 60, 40, 0.0);
    const auto start = solve_pose_graph(forget(random.graph), {.max_iterations = 0});
    EXPECT_LT(largest_position_difference(start.poses, random.truth), 1e-8);
    EXPECT_LT(largest_rotation_difference(start.poses, random.truth), 1e-8);
  }
}

TEST(Chordal, ComesCloseWithNoise) {
  Rng rng(5);
  const auto random = random_graph(rng, 200, 300, 1.0);
  PoseGraph graph = forget(random.graph);
  graph.poses = solve_pose_graph(graph, {.max_iterations = 0}).poses;
  const auto solution = solve_pose_graph(random.graph, kGiven);
  EXPECT_LT(chi2(graph), 1.5 * solution.summary.final_cost);
}

TEST(PoseGraphSolver, StaysAtTruth) {
  Rng rng(1);
  const auto random = random_graph(rng, 50, 50, 0.0);
  const auto solution = solve_pose_graph(random.graph, kGiven);
  EXPECT_EQ(solution.summary.termination, Termination::converged);
  EXPECT_LT(solution.summary.final_cost, 1e-15);
  EXPECT_LT(largest_position_difference(solution.poses, random.truth), 1e-10);
}

TEST(PoseGraphSolver, GradientVanishesAtTheOptimum) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    PoseGraph graph = random_graph(rng, 40, 40, 1.0).graph;
    const auto solution = solve_pose_graph(graph, kChordal);
    ASSERT_EQ(solution.summary.termination, Termination::converged);
    graph.poses = solution.poses;
    const double cost = chi2(graph);
    EXPECT_NEAR(cost, solution.summary.final_cost, 1e-9 * cost);
    for (int k = 0; k < 40; ++k) {  // any step costs
      const auto node = 1 + static_cast<std::size_t>(rng.index(39));
      const Pose3 kept = graph.poses[node];
      graph.poses[node] = retract(kept, random_tangent(rng, 1e-3, 1e-3));
      EXPECT_GT(chi2(graph), cost);
      graph.poses[node] = kept;
    }
  }
}

TEST(PoseGraphSolver, OptimumMovesWithTheGauge) {
  Rng rng(2);
  PoseGraph graph = random_graph(rng, 50, 40, 1.0).graph;
  const auto before = solve_pose_graph(graph, kChordal);
  const Pose3 motion = random_pose(rng, 100.0, 2.0);
  for (Pose3& pose : graph.poses) pose = motion * pose;
  const auto after = solve_pose_graph(graph, kChordal);
  std::vector<Pose3> expected;
  for (const Pose3& pose : before.poses) expected.push_back(motion * pose);
  EXPECT_NEAR(after.summary.final_cost, before.summary.final_cost, 1e-8 * before.summary.final_cost);
  EXPECT_LT(largest_position_difference(after.poses, expected), 1e-7);
  EXPECT_EQ(after.poses.front(), graph.poses.front());  // the anchor does not move
}

TEST(PoseGraphSolver, OptimumDoesNotDependOnOrderOrDirectionOfEdges) {
  Rng rng(3);
  auto random = random_graph(rng, 50, 40, 1.0);
  const auto before = solve_pose_graph(random.graph, kChordal);
  auto& edges = random.graph.edges;
  for (std::size_t k = edges.size() - 1; k > 0; --k) std::swap(edges[k], edges[rng.index(k + 1)]);
  const auto permuted = solve_pose_graph(random.graph, kChordal);
  EXPECT_LT(largest_position_difference(before.poses, permuted.poses), 1e-7);
  EXPECT_LT(largest_rotation_difference(before.poses, permuted.poses), 1e-7);
}

// Also when BLAS is set to more threads: its blocks would be others.
TEST(PoseGraphSolver, SameInputSameBits) {
  Rng rng(4);
  const auto random = random_graph(rng, 120, 1500, 1.0);
  openblas_set_num_threads(1);
  const auto poses = solve_pose_graph(random.graph, {}).poses;
  openblas_set_num_threads(3);
  EXPECT_EQ(solve_pose_graph(random.graph, {}).poses, poses);
  openblas_set_num_threads(1);
}

TEST(PoseGraphSolver, SolvesComponentsAsIfAlone) {
  Rng rng(5);
  const auto one = random_graph(rng, 30, 20, 1.0);
  const auto two = random_graph(rng, 25, 30, 1.0);
  PoseGraph both;  // interleaved: nodes of `one` at even positions as long as both last; one lonely node at the end
  std::vector<std::size_t> at_one(30);
  std::vector<std::size_t> at_two(25);
  for (std::size_t k = 0; k < 30; ++k) {
    at_one[k] = both.poses.size();
    both.poses.push_back(one.graph.poses[k]);
    if (k < 25) {
      at_two[k] = both.poses.size();
      both.poses.push_back(two.graph.poses[k]);
    }
  }
  const Pose3 lonely = random_pose(rng);
  both.poses.push_back(lonely);
  for (auto edge : one.graph.edges) {
    edge.from = at_one[edge.from];
    edge.to = at_one[edge.to];
    both.edges.push_back(edge);
  }
  for (auto edge : two.graph.edges) {
    edge.from = at_two[edge.from];
    edge.to = at_two[edge.to];
    both.edges.push_back(edge);
  }
  const auto solution = solve_pose_graph(both, kChordal);
  EXPECT_EQ(solution.summary.components, 3);
  EXPECT_EQ(solution.poses.back(), lonely);
  const auto alone_one = solve_pose_graph(one.graph, kChordal);
  const auto alone_two = solve_pose_graph(two.graph, kChordal);
  EXPECT_NEAR(solution.summary.final_cost, alone_one.summary.final_cost + alone_two.summary.final_cost, 1e-6);
  for (std::size_t k = 0; k < 30; ++k)
    EXPECT_LT((solution.poses[at_one[k]].translation - alone_one.poses[k].translation).norm(), 1e-6);
  for (std::size_t k = 0; k < 25; ++k)
    EXPECT_LT((solution.poses[at_two[k]].translation - alone_two.poses[k].translation).norm(), 1e-6);
}

TEST(PoseGraphSolver, EmptyAndSingleNodeAndSelfEdge) {
  EXPECT_EQ(solve_pose_graph({}, {}).summary.termination, Termination::converged);
  PoseGraph graph{.poses = {Pose3{}}, .edges = {}};
  EXPECT_EQ(solve_pose_graph(graph, {}).summary.termination, Termination::converged);
  Rng rng(6);
  PoseGraph looped = random_graph(rng, 5, 2, 1.0).graph;
  const auto without = solve_pose_graph(looped, kChordal);
  looped.edges.push_back({2, 2, random_pose(rng), Matrix6d::Identity()});
  EXPECT_LT(largest_position_difference(without.poses, solve_pose_graph(looped, kChordal).poses), 1e-7);
}

TEST(PoseGraphSolver, SaysWhenPosesAreNotDetermined) {
  Rng rng(7);
  PoseGraph graph = random_graph(rng, 6, 0, 0.0).graph;
  graph.edges[2].information.row(4).setZero();  // one axis of rotation unmeasured
  graph.edges[2].information.col(4).setZero();
  for (const auto& config : {kGiven, kChordal}) {
    const auto solution = solve_pose_graph(graph, config);
    EXPECT_EQ(solution.summary.termination, Termination::singular) << config.initialisation;
    for (const Pose3& pose : solution.poses) EXPECT_TRUE(is_valid(pose));
  }
  graph.edges[2].information.setZero();
  EXPECT_EQ(solve_pose_graph(graph, kChordal).summary.termination, Termination::singular);
}

TEST(PoseGraphSolver, RefusesNumbersThatAreNone) {
  Rng rng(8);
  const PoseGraph good = random_graph(rng, 6, 3, 1.0).graph;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int where = 0; where < 4; ++where) {
    PoseGraph bad = good;
    if (where == 0) bad.poses[3].translation.y() = nan;
    if (where == 1) bad.edges[1].T_from_to.rotation.w() = nan;
    if (where == 2) bad.edges[1].information(2, 3) = std::numeric_limits<double>::infinity();
    if (where == 3) bad.edges[1].T_from_to.rotation.coeffs() *= 2.0;
    const auto solution = solve_pose_graph(bad, {});
    EXPECT_EQ(solution.summary.termination, Termination::invalid_input) << where;
    EXPECT_EQ(solution.poses.size(), bad.poses.size());
  }
}

TEST(PoseGraphSolver, StepHalvingNeverRaisesTheCost) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    PoseGraph graph = random_graph(rng, 40, 30, 1.0).graph;
    for (std::size_t k = 1; k < graph.poses.size(); ++k) graph.poses[k] = random_pose(rng, 10.0, 2.0);  // hopeless
    const auto solution = solve_pose_graph(graph, kGiven);
    EXPECT_LE(solution.summary.final_cost, solution.summary.initial_cost);
    EXPECT_TRUE(is_usable(solution.summary.termination)) << to_string(solution.summary.termination);
  }
}

TEST(PoseGraphSolver, RobustLossSavesTheMapFromAFewWrongEdges) {
  for (const char* loss : {"huber", "cauchy"}) {
    Rng rng(9);
    auto random = random_graph(rng, 80, 60, 1.0);
    for (std::size_t k = 0; k < 4; ++k)
      random.graph.edges.push_back({10 * k, 79 - 7 * k, random_pose(rng), random.graph.edges[0].information});
    const auto roles = roles_from_numbering(random.graph);
    SolverConfig config{.initialisation = "given", .loss = {loss_kind(loss), 3.0}};
    const auto robust = solve_pose_graph(random.graph, config, roles);
    config.loss = {};
    const auto plain = solve_pose_graph(random.graph, config, roles);
    const double error = largest_position_difference(robust.poses, random.truth);
    EXPECT_LT(error, 0.5 * largest_position_difference(plain.poses, random.truth)) << loss;
    for (std::size_t k = 0; k < 4; ++k) EXPECT_LT(robust.weights[random.graph.edges.size() - 1 - k], 0.3) << loss;
    for (std::size_t e = 0; e < random.graph.edges.size(); ++e)
      if (roles[e] == EdgeRole::trusted) {
        EXPECT_EQ(robust.weights[e], 1.0);
      }
  }
}

}  // namespace pose_graph_solver_test
}  // namespace tutti::estimation
