// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/constraint.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "support/consistency/runs.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::consistency {
namespace constraint_test {

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

ConstraintMaker maker(const Scene& s) { return {s.graph, kAlpha, s.nodes, s.sync.pairs}; }

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

TEST(ConstraintMaker, CovarianceIsTheMapsCompoundedAndStandsInThePlaceOfOdometry) {
  const auto server = test::server_nodes(kAlpha, test::corridor(100));
  const auto s = scene(server, test::robot_nodes(test::corridor(100)));
  for (const auto& [from, to] : std::vector<std::pair<std::size_t, std::size_t>>{{0, 1}, {4, 5}, {10, 37}, {0, 99}}) {
    Matrix6d expected = Matrix6d::Zero();
    for (std::size_t k = from + 1; k <= to; ++k)
      expected = compound_covariance(server[k - 1].T_world_body.inverse() * server[k].T_world_body, expected,
                                     server[k].covariance);
    expected *= std::pow(ConstraintMaker::kOdometryInside, 2);
    const auto made = maker(s).make(from, to, ConstraintKind::large);
    EXPECT_LT((made.measurement.covariance - expected).norm(), 1e-9 * expected.norm()) << from << " -> " << to;
  }
}

TEST(ConstraintMaker, CovarianceStaysPositiveFarFromTheOrigin) {
  auto poses = test::corridor(300);
  for (std::size_t n = 0; n < poses.size(); ++n) poses[n].translation *= 300.0;  // a diverged robot: 36 km
  const auto s = scene(test::server_nodes(kAlpha, poses), test::robot_nodes(poses));
  for (std::size_t n = 1; n < 300; n += 7) {
    const auto made = maker(s).make(n - 1, n, ConstraintKind::small);
    const double smallest = eigen_of(made.measurement.covariance).values(0);
    EXPECT_GT(smallest, 0.0);
  }
}

TEST(ConstraintMaker, CountsSegmentsOverNodesTheRobotLacks) {
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

}  // namespace constraint_test
}  // namespace tutti::consistency
