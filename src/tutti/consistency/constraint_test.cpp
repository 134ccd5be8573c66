// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/constraint.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Eigenvalues>

#include "tutti/consistency/testing/runs.hpp"

namespace tutti::consistency {
namespace {

using test::kAlpha;

struct Scene {
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
  Synchronisation sync;
};

Scene scene(std::vector<ServerNode> server, const std::vector<RobotNode>& nodes) {
  Scene out{build_proxy_graph(7, std::move(server), {}, {}), nodes, {}};
  out.sync = synchronise(out.graph, kAlpha, out.nodes);
  return out;
}

ConstraintMaker maker(const Scene& s, const ConstraintConfig& config = {}) {
  return {s.graph, kAlpha, s.nodes, s.sync.pairs, config};
}

TEST(Distrust, FallsWithSupportFromDoubtToTrust) {
  const ConstraintConfig config{.trust = 0.1, .doubt = 2.0, .full_support = 3};
  EXPECT_EQ(distrust(0, config), 1.0);  // the server knows what odometry knows
  EXPECT_NEAR(distrust(1, config), 2.0, 1e-15);
  EXPECT_NEAR(distrust(2, config), std::sqrt(0.2), 1e-15);
  EXPECT_EQ(distrust(3, config), 0.1);
  EXPECT_EQ(distrust(100, config), 0.1);
  EXPECT_EQ(distrust(1, {.trust = 0.1, .full_support = 1}), 0.1);
}

// The two maps may lie anywhere: only the server's relative poses count, and the robot's own estimate not at all.
RC_GTEST_PROP(ConstraintMaker, TakesTheServersRelativePoseInAnyFrame, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto poses = test::corridor(40);
  const auto here = scene(test::server_nodes(kAlpha, poses), test::robot_nodes(test::corridor(40)));
  const auto there = scene(test::server_nodes(kAlpha, test::moved(test::random_pose(rng, 300.0), poses)),
                           test::robot_nodes(test::moved(test::random_pose(rng, 10.0), poses)));
  const auto a = rng.index(40), b = (a + 1 + rng.index(39)) % 40;
  const auto one = maker(here).make(a, b, ConstraintKind::mid), other = maker(there).make(b, a, ConstraintKind::mid);
  RC_ASSERT(one.from == 3 * std::min(a, b));
  RC_ASSERT(one.to == 3 * std::max(a, b));
  RC_ASSERT(one.from_stamp == test::stamp_of(std::min(a, b)));
  RC_ASSERT(one.revision == 7U);
  const Pose3 expected = poses[std::min(a, b)].inverse() * poses[std::max(a, b)];
  RC_ASSERT(local(one.measurement.T_a_b, expected).norm() < 1e-10);
  RC_ASSERT(local(other.measurement.T_a_b, expected).norm() < 1e-9);
  RC_ASSERT((one.measurement.covariance - other.measurement.covariance).norm() <
            1e-9 * one.measurement.covariance.norm());
}

TEST(ConstraintMaker, CovarianceIsCompoundedScaledAndFloored) {
  auto server = test::server_nodes(kAlpha, test::corridor(100), 10);
  Rng rng(3);
  for (ServerNode& node : server) {  // any positive definite covariance, any support
    Matrix6d root;
    for (double& x : root.reshaped()) x = rng.normal(1e-2);
    node.covariance = root * root.transpose();
    node.support = static_cast<std::uint32_t>(rng.index(6));
  }
  const auto s = scene(server, test::robot_nodes(test::corridor(100)));
  const ConstraintConfig config{.floor_translation_m = 2e-3, .floor_rotation_rad = 1e-3};
  for (const auto& [from, to] : std::vector<std::pair<std::size_t, std::size_t>>{{0, 1}, {4, 5}, {10, 37}, {0, 99}}) {
    Matrix6d expected = Matrix6d::Zero();
    std::uint32_t support = 99;
    for (std::size_t k = from + 1; k <= to; ++k) {
      const double factor = distrust(server[k].support, config);
      expected = compound_covariance(server[k - 1].T_world_body.inverse() * server[k].T_world_body, expected,
                                     factor * factor * server[k].covariance);
      support = std::min(support, server[k].support);
    }
    const double factor = distrust(support, config);
    expected.diagonal().head<3>().array() += 4e-6 * factor * factor;
    expected.diagonal().tail<3>().array() += 1e-6 * factor * factor;
    const auto made = maker(s, config).make(from, to, ConstraintKind::large);
    EXPECT_LT((made.measurement.covariance - expected).norm(), 1e-9 * expected.norm()) << from << " -> " << to;
    EXPECT_EQ(made.support, support);
  }
}

TEST(ConstraintMaker, CovarianceStaysPositiveFarFromTheOrigin) {
  auto poses = test::corridor(300);
  for (std::size_t n = 0; n < poses.size(); ++n) poses[n].translation *= 300.0;  // a diverged robot: 36 km
  const auto s = scene(test::server_nodes(kAlpha, poses), test::robot_nodes(poses));
  for (std::size_t n = 1; n < 300; n += 7) {
    const auto made = maker(s).make(n - 1, n, ConstraintKind::small);
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Matrix6d>(made.measurement.covariance).eigenvalues().minCoeff();
    EXPECT_GT(smallest, 5e-9);
  }
}

// "Who is wrong?": the same disagreement counts less when less supports it.
TEST(ConstraintMaker, LittleSupportMakesAWeakConstraint) {
  double previous = 1e9;
  for (const std::uint32_t support : {1U, 2U, 3U}) {
    const auto s =
        scene(test::server_nodes(kAlpha, test::corridor(30), support), test::robot_nodes(test::corridor(30)));
    const double trace = maker(s).make(5, 25, ConstraintKind::large).measurement.covariance.trace();
    EXPECT_LT(trace, 0.5 * previous);
    previous = trace;
  }
}

TEST(ConstraintMaker, CountsStretchesOverNodesTheRobotLacks) {
  const auto server = test::server_nodes(kAlpha, test::corridor(10));
  auto nodes = test::robot_nodes(test::corridor(10));
  nodes.erase(nodes.begin() + 4, nodes.begin() + 7);
  const auto all = scene(server, test::robot_nodes(test::corridor(10))), gap = scene(server, nodes);
  const auto expected = maker(all).make(3, 7, ConstraintKind::small),
             made = maker(gap).make(3, 4, ConstraintKind::small);
  EXPECT_EQ(made, expected);
}

TEST(ConstraintMaker, NothingToLink) {
  const auto none = scene({}, {});
  EXPECT_EQ(maker(none).size(), 0U);
  const auto one = scene(test::server_nodes(kAlpha, test::corridor(1)), test::robot_nodes(test::corridor(1)));
  EXPECT_EQ(maker(one).size(), 1U);
  EXPECT_THROW((void)maker(one).make(0, 0, ConstraintKind::small), std::logic_error);
}

}  // namespace
}  // namespace tutti::consistency
