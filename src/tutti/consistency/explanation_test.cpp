// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/explanation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "support/consistency/uncertainty.hpp"

namespace tutti::consistency {
namespace explanation_test {

using test::kAlpha;

constexpr std::size_t kNodes = 150;
constexpr std::size_t kFirst = 60, kLast = 75;

struct Scene {
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
  std::vector<NodePair> pairs;
};

/// The robot's odometry is the server's map (in another frame) off by its stated uncertainty; from kFirst to kLast it
/// slides by 10 cm a step, which its covariance may state. Another robot's nodes come first in the graph.
Scene scene(std::uint64_t seed, double slide_m, double stated = 1.0) {
  Rng rng(seed);
  const auto truth = test::corridor(kNodes);
  const test::WalkWithClosures map(kNodes, 25, {0.005, 3e-4}, {0.01, 1e-3});
  const auto server = test::server_nodes(test::kBravo, test::moved(test::random_pose(rng, 30.0), truth));
  auto robot = map.displace(truth, rng.fork("robot"));
  std::vector<Pose3> increments;
  for (std::size_t k = 1; k < kNodes; ++k) {
    increments.push_back(robot[k - 1].inverse() * robot[k]);
    if (k > kFirst && k <= kLast) increments.back() = increments.back() * test::at(-slide_m, 0, 0);
  }
  auto all = test::server_nodes(kAlpha, test::corridor(5));
  all.insert(all.end(), server.begin(), server.end());
  Scene out{.graph = build_proxy_graph(1, all, {}, {}),
            .nodes = test::robot_nodes(test::integrate(test::random_pose(rng, 30.0), increments), increments)};
  out.graph.uncertainties = {map.uncertainty(out.graph, test::kBravo)};
  for (std::size_t k = kFirst + 1; k <= kLast; ++k) out.nodes[k].odometry.covariance *= stated * stated;
  out.pairs = synchronise(out.graph, test::kBravo, out.nodes).pairs;
  return out;
}
Explanation explained(const Scene& s) {
  const DisagreementTest test(s.graph, test::kBravo, s.pairs, {});
  return explain(s.graph, test::kBravo, s.nodes, s.pairs, test, test(odometry_at(s.nodes, s.pairs)), 0.01);
}

TEST(Explanation, SaysNothingWhenTheTwoAgree) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Explanation e = explained(scene(seed, 0.0));
    EXPECT_FALSE(e.disagrees()) << "seed " << seed;
    EXPECT_TRUE(e.origins.empty()) << "seed " << seed;
    EXPECT_LT(e.aligned_rmse_m, 3.0 * e.expected_rmse_m) << "seed " << seed;
    EXPECT_GT(e.aligned_rmse_m, 0.2 * e.expected_rmse_m) << "seed " << seed;
  }
}

TEST(Explanation, FindsASlideWhereItIsAndRaisesAnAlertUnlessOdometryStatedIt) {
  for (const double stated : {1.0, 100.0})
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
      const Explanation e = explained(scene(seed, 0.1, stated));
      EXPECT_TRUE(e.disagrees());
      ASSERT_FALSE(e.origins.empty()) << "seed " << seed;
      EXPECT_LE(e.origins.size(), 2U) << "seed " << seed;
      const SuspectedOrigin& origin = *std::ranges::max_element(e.origins, {}, &SuspectedOrigin::significance);
      EXPECT_LT(std::abs(origin.from - test::stamp_of(kFirst)), 3.5 * test::kNodePeriod_s) << "seed " << seed;
      EXPECT_GT(origin.until - test::stamp_of(kFirst), 0.0);
      EXPECT_GE(origin.significance, 1.0);
      EXPECT_EQ(origin.alert, stated == 1.0) << "seed " << seed;
    }
}

// Measured by hand on the poses at both ends, whatever the frames.
TEST(Explanation, TranslationAndRotationAreThoseOfTheRelativePose) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Scene s = scene(seed, 0.1);
    const Explanation e = explained(s);
    ASSERT_FALSE(e.origins.empty());
    const auto& worst = *std::ranges::max_element(e.origins, {}, &SuspectedOrigin::significance);
    EXPECT_NEAR(worst.translation_m, 1.5, 0.4);  // fifteen steps of 10 cm
    for (const SuspectedOrigin& origin : e.origins) {
      Pose3 T_from_until;
      double length = 0.0;
      const Pose3 *from = nullptr, *until = nullptr, *last = nullptr;
      for (const RobotNode& node : s.nodes)
        if (node.stamp > origin.from && node.stamp <= origin.until) T_from_until = T_from_until * node.odometry.T_a_b;
      for (const ProxyNode& node : s.graph.nodes) {
        if (node.chain.robot != test::kBravo || node.stamp < origin.from || node.stamp > origin.until) continue;
        if (node.stamp == origin.from) from = &node.T_world_body;
        if (node.stamp == origin.until) until = &node.T_world_body;
        if (last != nullptr) length += (node.T_world_body.translation - last->translation).norm();
        last = &node.T_world_body;
      }
      ASSERT_TRUE(from != nullptr && until != nullptr);
      EXPECT_LE((origin.place_m - from->translation).norm(), 0.5 * length + 1.0)
          << "about half-way, in the map's frame";
      const Pose3 map = from->inverse() * *until;
      EXPECT_NEAR(origin.translation_m, (map.translation - T_from_until.translation).norm(), 1e-9);
      EXPECT_NEAR(origin.rotation_rad, map.rotation.angularDistance(T_from_until.rotation), 1e-9);
      EXPECT_NEAR(origin.length_m, length, 1e-9);
    }
  }
}

TEST(Explanation, LaysOutTheRunByTimeAndDistance) {
  const Explanation e = explained(scene(1, 0.1));
  ASSERT_EQ(e.stamps.size(), kNodes);
  ASSERT_EQ(e.distance_m.size(), kNodes);
  EXPECT_EQ(e.distance_m.front(), 0.0);
  for (std::size_t k = 1; k < kNodes; ++k) {
    EXPECT_LT(e.stamps[k - 1], e.stamps[k]);
    EXPECT_LT(e.distance_m[k - 1], e.distance_m[k]);
  }
  EXPECT_EQ(e.significance.rows(), static_cast<Eigen::Index>(kNodes));
  EXPECT_EQ(e.significance.cols(), static_cast<Eigen::Index>(e.scale_length_m.size()));
  EXPECT_NEAR(e.scale_length_m.front(), e.distance_m.back(), 0.02 * e.distance_m.back());
  EXPECT_TRUE(std::ranges::is_sorted(e.scale_length_m, std::greater<>()));
}

// At the finest scale, that is: what is left over after the alignment is everywhere at the others.
TEST(Explanation, TheDisagreementStandsOutWhereTheSlideIs) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Explanation e = explained(scene(seed, 0.1));
    Eigen::Index node = 0;
    EXPECT_GT(e.significance.rightCols<1>().maxCoeff(&node), 1.0);
    EXPECT_GE(node + 5, static_cast<Eigen::Index>(kFirst)) << "seed " << seed;
    EXPECT_LE(node, static_cast<Eigen::Index>(kLast) + 5) << "seed " << seed;
  }
}

TEST(Explanation, HasLittleWhenTheServerSendsNoUncertainty) {
  Scene s = scene(1, 0.1);
  s.graph.uncertainties.clear();
  const Explanation e = explained(s);
  EXPECT_EQ(e.expected_rmse_m, 0.0);
  EXPECT_FALSE(e.disagrees());
  EXPECT_TRUE(e.origins.empty());
}

}  // namespace explanation_test
}  // namespace tutti::consistency
