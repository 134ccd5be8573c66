// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/gnc.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/estimation/random_graphs.hpp"

namespace tutti::estimation {
namespace gnc_test {

using namespace testing;

/// Share of wrong loops -> GNC finds exactly the planted ones, and the map of the true ones alone.
void expect_planted_outliers_found(std::uint64_t seed, std::size_t inliers, std::size_t outliers) {
  Rng rng(seed);
  auto random = random_graph(rng, 100, inliers, 0.5, 0.03, 0.01);
  PoseGraph clean = random.graph;
  for (std::size_t k = 0; k < outliers; ++k) {
    const auto a = static_cast<std::size_t>(rng.index(100));
    const auto b = (a + 5 + static_cast<std::size_t>(rng.index(90))) % 100;
    random.graph.edges.push_back(
        {a, b, random.truth[a].inverse() * random.truth[b] * random_pose(rng, 2.0, 0.5), clean.edges[0].information});
  }
  random.graph.poses = solve_pose_graph(clean, {}).poses;
  const auto expected = random.graph.poses;
  for (std::size_t k = 1; k < random.graph.poses.size(); ++k) random.graph.poses[k] = Pose3{};
  std::vector<EdgeRole> roles(random.graph.edges.size(), EdgeRole::robust);
  std::fill_n(roles.begin(), 99, EdgeRole::trusted);

  const auto result = solve_pose_graph_gnc(random.graph, {}, roles);
  ASSERT_TRUE(is_usable(result.solution.summary.termination));
  std::size_t lost = 0;
  for (std::size_t e = 0; e < random.graph.edges.size(); ++e) {
    if (e >= clean.edges.size()) {
      EXPECT_EQ(result.inlier_weight[e], 0.0) << "wrong edge kept, seed " << seed;
    } else {
      lost += result.inlier_weight[e] < 1.0 ? 1 : 0;
    }
  }
  EXPECT_LE(lost, inliers / 20) << "seed " << seed;
  EXPECT_LT(largest_position_difference(result.solution.poses, expected), 0.02) << "seed " << seed;
}

TEST(Gnc, FindsThirtyPercentOutliers) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) expect_planted_outliers_found(seed, 70, 30);
}

TEST(Gnc, FindsFiftyPercentOutliers) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) expect_planted_outliers_found(seed, 60, 60);
}

TEST(Gnc, LeavesACleanGraphAlone) {
  Rng rng(1);
  const auto random = random_graph(rng, 60, 60, 0.3);
  const auto result = solve_pose_graph_gnc(random.graph, {});
  const auto plain = solve_pose_graph(random.graph, {});
  EXPECT_EQ(result.solution.poses, plain.poses);
  EXPECT_EQ(result.outer_iterations, 0);
}

// The weights of few closures change from step to step, so the factor before still tells the way.
TEST(Gnc, WhereFewClosuresAreDoubtfulFewStepsAreFactorised) {
  Rng rng(6);
  const auto random = random_graph(rng, 200, 2000, 1.0);
  std::vector<EdgeRole> roles(random.graph.edges.size(), EdgeRole::robust);
  std::fill_n(roles.begin(), 199, EdgeRole::trusted);
  const auto result = solve_pose_graph_gnc(random.graph, {.confidence = 0.99}, roles);
  const auto refused = std::ranges::count(result.inlier_weight, 0.0);
  EXPECT_GE(refused, 5);  // by chance alone
  EXPECT_LE(refused, 40);
  EXPECT_GE(result.outer_iterations, 6);
  EXPECT_LE(result.solution.summary.factorisations, 4);  // 10 with one a step
}

// Once they are refused all else fits: to double the parameter from where they set it took 22 steps.
TEST(Gnc, ClosuresThatAreFarOffAreSteppedOver) {
  Rng rng(8);
  auto random = random_graph(rng, 60, 600, 0.5);
  const std::size_t right = random.graph.edges.size();
  for (std::size_t k = 0; k < 4; ++k)
    random.graph.edges.push_back({k, k + 30, random_pose(rng, 300.0, 1.0), random.graph.edges.front().information});
  std::vector<EdgeRole> roles(random.graph.edges.size(), EdgeRole::robust);
  std::fill_n(roles.begin(), 59, EdgeRole::trusted);
  const auto result = solve_pose_graph_gnc(random.graph, {}, roles);
  for (std::size_t e = 0; e < random.graph.edges.size(); ++e)
    EXPECT_EQ(result.inlier_weight[e], e < right ? 1.0 : 0.0) << e;
  EXPECT_LE(result.outer_iterations, 6);
}

TEST(Gnc, PassesFailuresOn) {
  Rng rng(2);
  PoseGraph graph = random_graph(rng, 6, 0, 0.0).graph;
  graph.edges[2].information.setZero();
  EXPECT_EQ(solve_pose_graph_gnc(graph, {}).solution.summary.termination, Termination::singular);
}

TEST(Gnc, SurvivesAComponentJoinedByWrongEdgesOnly) {
  Rng rng(3);
  const auto one = random_graph(rng, 20, 10, 0.0);
  PoseGraph graph = one.graph;
  for (const Pose3& pose : one.truth) graph.poses.push_back(pose);
  for (auto edge : one.graph.edges) {
    edge.from += 20;
    edge.to += 20;
    graph.edges.push_back(edge);
  }
  const std::size_t first_link = graph.edges.size();
  for (std::size_t k = 0; k < 6; ++k)
    graph.edges.push_back({k, 25 + k, random_pose(rng, 5.0, 1.0), graph.edges[0].information});
  std::vector<EdgeRole> roles(graph.edges.size(), EdgeRole::trusted);
  std::fill(roles.begin() + static_cast<std::ptrdiff_t>(first_link), roles.end(), EdgeRole::robust);
  const auto result = solve_pose_graph_gnc(graph, {}, roles);
  EXPECT_TRUE(is_usable(result.solution.summary.termination)) << to_string(result.solution.summary.termination);
  for (const Pose3& pose : result.solution.poses) EXPECT_TRUE(is_valid(pose));
}

}  // namespace gnc_test
}  // namespace tutti::estimation
