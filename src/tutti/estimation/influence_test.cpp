// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/influence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {
namespace influence_test {

using namespace testing;

/// Solved to the last digit.
std::vector<Pose3> optimum(const PoseGraph& graph) {
  const auto result = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-14});
  EXPECT_TRUE(is_usable(result.summary.termination));
  return result.poses;
}

using Groups = std::vector<std::vector<std::size_t>>;

/// Each closure by itself.
Groups closures_of(const PoseGraph& graph) {
  Groups out;
  for (std::size_t e = graph.poses.size() - 1; e < graph.edges.size(); ++e) out.push_back({e});
  return out;
}

std::vector<Influence> influences_of(const PoseGraph& graph, const std::vector<Pose3>& poses, const Groups& groups,
                                     std::size_t count, double least_distance = 0.0) {
  return largest_influences(graph, poses, roles_from_numbering(graph), groups, count, least_distance);
}

PoseGraph without(PoseGraph graph, std::size_t edge) {
  graph.edges.erase(graph.edges.begin() + static_cast<std::ptrdiff_t>(edge));
  return graph;
}

PoseGraph without(PoseGraph graph, const std::vector<std::size_t>& group) {
  for (auto e = group.rbegin(); e != group.rend(); ++e) graph = without(std::move(graph), *e);
  return graph;
}

TEST(Influence, IsWhatTakingTheGroupAwayDoes) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Rng rng(seed);
    const PoseGraph graph = random_graph(rng, 40, 8, 0.02).graph;
    const std::vector<Pose3> poses = optimum(graph);
    const Groups groups = {{39}, {40}, {41, 43}, {42}, {44, 45, 46}};
    const auto influences = influences_of(graph, poses, groups, 4);
    ASSERT_EQ(influences.size(), 4U);
    for (const Influence& influence : influences) {
      const PoseGraph less = without(graph, groups[influence.group]);
      const std::vector<Pose3> moved = optimum(less);
      double off = 0.0, largest = 0.0;
      for (std::size_t k = 0; k < poses.size(); ++k) {
        const Vector6d truly = local(poses[k], moved[k]);
        off = std::max(off, (truly - influence.shift.segment<6>(static_cast<Eigen::Index>(6 * k))).norm());
        largest = std::max(largest, truly.norm());
      }
      EXPECT_LT(off, 0.05 * largest) << seed << " group " << influence.group;
    }
  }
}

TEST(Influence, TheFarthestComeFirstAndInTheirOwnMeasure) {
  Rng rng(7);
  PoseGraph graph = random_graph(rng, 60, 12, 0.05).graph;
  graph.edges[64].T_from_to.translation.y() += 1.0;  // one of twelve is wrong
  const std::vector<Pose3> poses = optimum(graph);
  const auto all = influences_of(graph, poses, closures_of(graph), 100);
  ASSERT_EQ(all.size(), 12U);
  EXPECT_EQ(all[0].group, 64U - 59U);
  for (std::size_t k = 1; k < all.size(); ++k) EXPECT_GE(all[k - 1].distance, all[k].distance);
  const auto far = influences_of(graph, poses, closures_of(graph), 100, all[4].distance);
  ASSERT_EQ(far.size(), 4U);
  EXPECT_EQ(far.back().group, all[3].group);
  EXPECT_TRUE(influences_of(graph, poses, closures_of(graph), 100, all[0].distance).empty());
  const auto three = influences_of(graph, poses, closures_of(graph), 3);
  ASSERT_EQ(three.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(three[k].group, all[k].group);
    // distance^2 = shift^T H shift, H the sum over all edges.
    double energy = 0.0;
    for (const PoseGraphEdge& edge : graph.edges) {
      const auto factor = linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to);
      const auto of = [&](std::size_t node) { return three[k].shift.segment<6>(static_cast<Eigen::Index>(6 * node)); };
      const Vector6d change = factor.J_i * of(edge.from) + factor.J_j * of(edge.to);
      energy += change.dot(edge.information * change);
    }
    EXPECT_NEAR(three[k].distance, std::sqrt(energy), 1e-6 * three[k].distance);
  }
}

TEST(Influence, AGroupThatAloneHoldsItsEndsTogetherIsLeftOut) {
  Rng rng(3);
  const PoseGraph graph = random_graph(rng, 20, 0, 0.1).graph;  // a chain
  const std::vector<EdgeRole> all_may_be_wrong(graph.edges.size(), EdgeRole::robust);
  EXPECT_TRUE(largest_influences(graph, optimum(graph), all_may_be_wrong, Groups{{0}, {7, 8}, {18}}, 3).empty());
}

TEST(GroupMisfits, AreWhatTakingTheGroupAwayDoes) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Rng rng(seed);
    PoseGraph graph = random_graph(rng, 40, 9, 0.1).graph;
    for (std::size_t e = 39; e < 42; ++e) graph.edges[e].T_from_to.translation.y() += 0.05;
    const std::vector<Pose3> poses = optimum(graph);
    const Groups groups = {{39, 40, 41}, {44, 46}, {47}};
    const auto misfits = group_misfits(graph, poses, roles_from_numbering(graph), groups);  // its chain is compounded
    ASSERT_EQ(misfits.size(), groups.size());
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const PoseGraph less = without(graph, groups[g]);
      const std::vector<Pose3> moved = optimum(less);
      const PoseGraphEdge& middle = graph.edges[groups[g][groups[g].size() / 2]];
      const auto relative = [&](const std::vector<Pose3>& p) { return p[middle.from].inverse() * p[middle.to]; };
      const std::vector<std::pair<std::size_t, std::size_t>> pair = {{middle.from, middle.to}};
      const Vector6d by = local(relative(moved), relative(poses));
      const double expected = by.dot(relative_covariances(less, moved, pair)[0].ldlt().solve(by));
      EXPECT_NEAR(misfits[g], expected, 0.05 * expected + 1e-3) << seed << " group " << g;
    }
  }
}

/// Each of five agrees with the odometry of a ring, and so do all of them: many are no more evidence than one.
TEST(GroupMisfits, DoNotGrowWithTheGroup) {
  PoseGraph graph;
  constexpr std::size_t kSteps = 60;
  const Pose3 step{Eigen::Quaterniond(Eigen::AngleAxisd(2 * M_PI / kSteps, Eigen::Vector3d::UnitZ())), {1, 0, 0}};
  for (std::size_t k = 0; k < kSteps; ++k) graph.poses.push_back(k == 0 ? Pose3{} : graph.poses.back() * step);
  for (std::size_t k = 1; k < kSteps; ++k) graph.edges.push_back({k - 1, k, step, 400.0 * Matrix6d::Identity()});
  const Pose3 wrong{Eigen::Quaterniond::Identity(), {0, 0, 5.0}};  // about what 59 steps add up to
  std::vector<std::size_t> group;
  double one = 0.0;
  for (std::size_t k = 0; k < 5; ++k) {
    const std::size_t from = k, to = kSteps - 1 - k;
    group.push_back(graph.edges.size());
    graph.edges.push_back(
        {from, to, graph.poses[from].inverse() * wrong * graph.poses[to], 1e4 * Matrix6d::Identity()});
    const double misfit = group_misfits(graph, optimum(graph), roles_from_numbering(graph), Groups{group}).front();
    if (k == 0) one = misfit;
    EXPECT_GT(misfit, 0.5 * one);
    EXPECT_LT(misfit, 1.5 * one) << k;
  }
  EXPECT_GT(one, 1.0);
  // One by one they look harmless: the other four hold.
  const Groups one_by_one = {{group[2]}};
  EXPECT_LT(group_misfits(graph, optimum(graph), {}, one_by_one).front(), 0.5);
}

TEST(GroupMisfits, AGroupThatAloneHoldsItsEndsTogetherContradictsNothing) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 20, 3, 0.3).graph;
  std::erase_if(graph.edges, [](const PoseGraphEdge& e) { return (e.from < 10) != (e.to < 10); });
  graph.edges.push_back({3, 15, random_pose(rng)});
  const Groups groups = {{graph.edges.size() - 1}};
  EXPECT_LT(group_misfits(graph, optimum(graph), {}, groups)[0], 1e-3);
  EXPECT_TRUE(group_misfits(graph, optimum(graph), {}, {}).empty());
}

/// A robot whose trajectory is in segments: what lies in another segment is no witness.
TEST(GroupMisfits, EdgesOfAnotherComponentSayNothing) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 20, 5, 0.3).graph;
  std::erase_if(graph.edges, [](const PoseGraphEdge& e) { return (e.from < 10) != (e.to < 10); });
  const std::size_t first = graph.edges.size();
  graph.edges.push_back({2, 7, random_pose(rng)});
  graph.edges.push_back({12, 17, random_pose(rng)});
  const Groups groups = {{first, first + 1}, {first + 1}};
  const auto misfits = group_misfits(graph, optimum(graph), {}, groups);
  EXPECT_GT(misfits[1], 0.0);
  EXPECT_NEAR(misfits[0], misfits[1], 1e-9 * misfits[1]);
}

// Submaps that follow each other share a keyframe: a closure of it with itself, where nothing moves.
TEST(GroupMisfits, AClosureOfTheFixedNodeWithItselfMovesNothing) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 20, 3, 0.1).graph;
  graph.edges.push_back({0, 0, Pose3{}});
  const Groups groups = {{graph.edges.size() - 1}};
  EXPECT_EQ(group_misfits(graph, optimum(graph), {}, groups).front(), 0.0);
}

TEST(Influence, NothingToSay) {
  Rng rng(3);
  PoseGraph graph = random_graph(rng, 20, 2, 0.1).graph;
  EXPECT_TRUE(influences_of(graph, graph.poses, {}, 3).empty());
  EXPECT_TRUE(influences_of(graph, graph.poses, closures_of(graph), 0).empty());
  for (PoseGraphEdge& edge : graph.edges) edge.information.setZero();
  EXPECT_TRUE(influences_of(graph, graph.poses, closures_of(graph), 3).empty());
}

}  // namespace influence_test
}  // namespace tutti::estimation
