// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/time_chain.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/consistency/runs.hpp"
#include "tutti/consistency/links.hpp"

namespace tutti::consistency {
namespace time_chain_test {

using namespace test;

/// 30 nodes of a robot whose every third is known to the server, in a graph that begins with another robot's.
struct EveryThird {
  std::vector<Pose3> truth = corridor(30);
  std::vector<RobotNode> nodes = robot_nodes(truth);
  ProxyGraph graph;
  std::vector<NodePair> pairs;

  EveryThird() {
    std::vector<ServerNode> known = server_nodes(kAlpha, corridor(5));
    const auto all = server_nodes(kBravo, truth);
    for (std::size_t n = 0; n < all.size(); n += 3) {
      pairs.push_back({.proxy = known.size(), .robot = n});
      known.push_back(all[n]);
    }
    graph = build_proxy_graph(1, std::move(known), {{kAlpha, 0}, {kBravo, 0}}, {});
  }
};

TEST(TimeChain, CompoundsTheOdometryBetweenSynchronisedNodes) {
  const EveryThird run;
  const TimeChain chain = time_chain(run.graph, run.nodes, run.pairs);
  ASSERT_EQ(chain.server.size(), run.pairs.size());
  ASSERT_EQ(chain.odometry.size(), run.pairs.size());
  for (std::size_t k = 0; k < run.pairs.size(); ++k) {
    EXPECT_EQ(chain.server[k], run.truth[3 * k]);
    EXPECT_EQ(chain.robot[k], run.truth[3 * k]);
    if (k == 0) continue;
    const Vector6d off = local(chain.odometry[k].T_a_b, run.truth[3 * k - 3].inverse() * run.truth[3 * k]);
    EXPECT_LT(off.norm(), 1e-12);
    // Three steps know less than one, and turns of the first move the end of the last.
    EXPECT_NEAR(chain.odometry[k].covariance(5, 5), 3.0 * covariance_of({})(5, 5), 1e-12);
    EXPECT_GT(chain.odometry[k].covariance.trace(), 3.0 * covariance_of({}).trace());
  }
}

TEST(TimeChain, AlignedRmseIgnoresTheFrame) {
  const std::vector<Pose3> server = corridor(40);
  Rng rng(3);
  EXPECT_LT(aligned_rmse(server, moved(random_pose(rng, 20.0), server)), 1e-9);
  std::vector<Pose3> robot = server;
  for (std::size_t k = 0; k < robot.size(); ++k) robot[k].translation.z() += k % 2 == 0 ? 0.1 : -0.1;
  const double off = aligned_rmse(server, robot);
  EXPECT_NEAR(off, 0.1, 0.002);
  EXPECT_NEAR(aligned_rmse(server, moved(random_pose(rng, 20.0), robot)), off, 1e-9);
}

TEST(NodeAt, FindsSynchronisedNodesOnly) {
  const EveryThird run;
  const Ledger ledger;
  const PolicyInput input{
      .graph = run.graph, .chain = kBravo, .nodes = run.nodes, .pairs = run.pairs, .ledger = ledger};
  for (std::size_t n = 0; n < run.nodes.size(); ++n) {
    const auto found = node_at(input, stamp_of(n));
    ASSERT_EQ(found.has_value(), n % 3 == 0) << n;
    if (found) {
      EXPECT_EQ(*found, n / 3);
    }
  }
  EXPECT_FALSE(node_at(input, stamp_of(100)).has_value());
}

}  // namespace time_chain_test
}  // namespace tutti::consistency
