// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/policies.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <set>

#include "support/consistency/closed_loop.hpp"
#include "support/consistency/runs.hpp"

namespace tutti::lab {
namespace policies_test {

using namespace consistency;
using consistency::test::kAlpha;
using Pairs = std::set<std::pair<std::size_t, std::size_t>>;  // of nodes

struct Scene {
  explicit Scene(std::size_t length)
      : graph(consistency::test::proxy_graph(consistency::test::corridor(length))),
        nodes(consistency::test::robot_nodes(consistency::test::corridor(length))) {
    for (std::size_t n = 0; n < length; ++n) pairs.push_back({n, n});
  }
  [[nodiscard]] Selection choose(const ConstraintPolicy& policy) const {
    return policy.choose({graph, kAlpha, nodes, pairs, ledger});
  }
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
  std::vector<NodePair> pairs;
  Ledger ledger;
};

Pairs linked(const Selection& selection, std::optional<ConstraintKind> kind = {}) {
  Pairs out;
  for (const Constraint& c : selection.constraints)
    if (!kind || c.kind == *kind) out.emplace(c.from / 3, c.to / 3);  // robot_nodes: chain_index = 3 node
  return out;
}

TEST(Policies, AreFoundByNameTheProductsToo) {
  for (const char* name :
       {"none", "every_node", "spectral", "adaptive", "every_node_2", "uniform", "random", "skeleton"})
    EXPECT_TRUE(lab::make_policy(name, {}, Rng(1)).has_value()) << name;
  const auto unknown = lab::make_policy("oracle", {}, Rng(1));
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().code, ErrorCode::configuration);
  EXPECT_EQ(unknown.error().message,
            "policy 'oracle' is unknown, expected none, every_node, spectral, adaptive, every_node_2, uniform, "
            "random or skeleton");
}

TEST(Policies, ZeroOrOneNodeGivesNothingAndTakesNothingAway) {
  for (const std::size_t length : {0U, 1U})
    for (const char* name : {"every_node_2", "uniform", "random", "skeleton"}) {
      const auto selection = Scene(length).choose(**lab::make_policy(name, {}, Rng(1)));
      EXPECT_TRUE(selection.constraints.empty()) << name;
      EXPECT_FALSE(selection.replaces_all) << name;
    }
}

TEST(EveryNode2, LinksTheNextTwo) {
  EXPECT_EQ(linked(Scene(5).choose(EveryNode2Policy())),
            (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 2}, {1, 3}, {2, 4}}));
}

RC_GTEST_PROP(Uniform, IsAChainOfEquallyLongLinks, ()) {
  const auto length = *rc::gen::inRange<std::size_t>(2, 150);
  const auto budget = *rc::gen::inRange<std::size_t>(1, 200);
  const auto selection = Scene(length).choose(UniformPolicy(budget));
  RC_ASSERT(selection.replaces_all);
  RC_ASSERT(selection.constraints.size() == std::min(budget, length - 1));
  std::size_t at = 0, shortest = length, longest = 0;
  for (const auto& [a, b] : linked(selection)) {
    RC_ASSERT(a == at);
    shortest = std::min(shortest, b - a);
    longest = std::max(longest, b - a);
    at = b;
  }
  RC_ASSERT(at == length - 1);
  RC_ASSERT(longest - shortest <= 1U);
}

TEST(Uniform, ABudgetOfNothingIsNothing) {
  const auto selection = Scene(10).choose(UniformPolicy(0));
  EXPECT_TRUE(selection.constraints.empty());
}

RC_GTEST_PROP(Random, MeetsTheBudgetAndFollowsTheSeed, (std::uint64_t seed)) {
  const Scene scene(120);
  const auto budget = *rc::gen::inRange<std::size_t>(0, 150);
  const auto selection = scene.choose(RandomPolicy(budget, Rng(seed)));
  RC_ASSERT(selection.constraints.size() == budget);
  RC_ASSERT(linked(selection).size() == budget);
  RC_ASSERT(scene.choose(RandomPolicy(budget, Rng(seed))).constraints == selection.constraints);
}

TEST(Random, DrawsAllKindsAllOverTheRun) {
  const auto selection = Scene(200).choose(RandomPolicy(120, Rng(1)));
  for (const auto kind : {ConstraintKind::small, ConstraintKind::mid, ConstraintKind::large})
    EXPECT_GT(linked(selection, kind).size(), 10U);
  for (std::size_t quarter = 0; quarter < 4; ++quarter)
    EXPECT_GT(std::ranges::count_if(linked(selection), [&](const auto& l) { return l.first / 50 == quarter; }), 10);
}

TEST(Random, ATinyGraphHasOnlySoManyLinks) {
  const auto selection = Scene(3).choose(RandomPolicy(50, Rng(1)));
  EXPECT_LE(selection.constraints.size(), 3U);
  EXPECT_GE(selection.constraints.size(), 2U);
}

/// The robot's chain bends at one node, everything else agrees.
Scene bent_scene(std::size_t length, std::size_t at_node, double turn_rad) {
  Scene scene(length);
  scene.nodes[at_node].odometry.T_a_b.rotation =
      scene.nodes[at_node].odometry.T_a_b.rotation * so3_exp(Eigen::Vector3d(0, 0, turn_rad));
  return scene;
}

TEST(Skeleton, TakesNothingWhenTheRawChainAgrees) {
  const auto selection = Scene(80).choose(SkeletonPolicy());
  EXPECT_TRUE(selection.constraints.empty());
  EXPECT_TRUE(selection.replaces_all);  // and gives up what it kept
}

TEST(Skeleton, LinksAreAChainFromTheFirstNodeToTheLast) {
  const auto selection = bent_scene(80, 40, 0.2).choose(SkeletonPolicy());
  ASSERT_GE(selection.constraints.size(), 2U);
  EXPECT_LT(selection.constraints.size(), 40U);
  std::size_t end = 0;
  for (const auto& [from, to] : linked(selection)) {
    EXPECT_EQ(from, end);
    end = to;
  }
  EXPECT_EQ(end, 79U);
}

TEST(Skeleton, LinksAreShortWhereTheDriftWasBorn) {
  const auto links = linked(bent_scene(120, 60, 0.2).choose(SkeletonPolicy()));
  std::size_t shortest = 120;
  double at = 0.0;
  for (const auto& [from, to] : links)
    if (to - from < shortest) {
      shortest = to - from;
      at = 0.5 * static_cast<double>(from + to);
    }
  EXPECT_LE(shortest, 3U);
  EXPECT_NEAR(at, 60.0, 5.0);
}

TEST(Skeleton, UsesRawOdometryNotWhatItCorrectedBefore) {
  Scene scene = bent_scene(80, 40, 0.2);
  const auto before = linked(scene.choose(SkeletonPolicy()));
  for (RobotNode& node : scene.nodes) node.T_map_body = node.T_map_body * Pose3{so3_exp({0, 0, 0.1}), {1, 2, 3}};
  EXPECT_EQ(linked(scene.choose(SkeletonPolicy())), before);
}

/// A whole mission by a policy of this room.
consistency::test::LoopConfig by(const ConstraintPolicy& policy) {
  consistency::test::LoopConfig out;
  out.other_policy = [&policy](std::size_t) -> const ConstraintPolicy& { return policy; };
  return out;
}

/// 60 nodes, yaw drift of 0.3 degrees per metre and a scale error of 0.3 %: raw odometry some 0.7 m off.
consistency::test::Mission short_mission(std::uint64_t seed) {
  consistency::test::OdometryNoise noise{.translation_m = 0.02, .rotation_rad = 0.0018};
  noise.yaw_bias_rad = 0.3 * std::numbers::pi / 180.0;
  noise.scale_bias = 0.003;
  return corridor_mission(60, noise, seed, {.smooth_m = 0.02, .local_m = 0.003, .local_rad = 0.0005});
}

TEST(ClosedLoop, UniformReachesTheServersMapWithThirty) {
  const UniformPolicy uniform(30);
  const auto few = run_closed_loop(consistency::test::corridor_mission(300, {}, 2), by(uniform));
  EXPECT_EQ(few.constraints, 30U);
  EXPECT_LT(few.agreement_m, 0.038);
}

TEST(ClosedLoop, SkeletonAgreesWithAHandfulOfConstraints) {
  const SkeletonPolicy fine(0.02), coarse(0.06), coarsest(0.1);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto close = run_closed_loop(short_mission(seed), by(fine));
    EXPECT_GT(close.onboard_m, 0.3);
    EXPECT_LT(close.agreement_m, 0.015) << "seed " << seed;
    const auto rough = run_closed_loop(short_mission(seed), by(coarse));
    EXPECT_LT(rough.agreement_m, 0.045) << "seed " << seed;
    EXPECT_LE(rough.constraints, 12U) << "seed " << seed;
    EXPECT_LT(rough.constraints, close.constraints);
  }
  const auto longer = run_closed_loop(consistency::test::corridor_mission(400, {}, 1), by(coarsest));
  EXPECT_LT(longer.agreement_m, 0.07);
  EXPECT_LE(longer.constraints, 20U);
}

}  // namespace policies_test
}  // namespace tutti::lab
