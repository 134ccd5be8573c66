// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/map_covariance.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/consistency/uncertainty.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::robot {
namespace map_covariance_test {

using consistency::test::kAlpha, consistency::test::WalkWithClosures;

/// A robot on a map of 240 nodes whose errors are those of `walk`; one link spans its whole run.
struct Scene {
  explicit Scene(const WalkWithClosures& walk, PoseSigma step)
      : truth(consistency::test::corridor(walk.nodes())), graph(consistency::test::proxy_graph(truth)) {
    Matrix6d covariance = Matrix6d::Zero();
    covariance.diagonal() << Eigen::Vector3d::Constant(step.position_m * step.position_m),
        Eigen::Vector3d::Constant(step.rotation_rad * step.rotation_rad);
    for (ProxyNode& node : graph.nodes) {
      stamps.push_back(node.stamp);
      node.covariance = stamps.size() == 1 ? Matrix6d(Matrix6d::Zero()) : covariance;
    }
    for (std::size_t k = 1; k < truth.size(); ++k)
      smoother.odometry.push_back({truth[k - 1].inverse() * truth[k], covariance});
    smoother.poses = truth;
    graph.uncertainties = {walk.uncertainty(graph, kAlpha)};
    ledger = linked(0, truth.size() - 1);
  }
  [[nodiscard]] consistency::Ledger linked(std::size_t from, std::size_t to) const {
    return consistency::Ledger({{.from_stamp = stamps[from], .to_stamp = stamps[to], .from = from, .to = to}});
  }
  [[nodiscard]] Matrix6d covariance(const consistency::Ledger& kept) const {
    return map_covariance(graph, kAlpha, stamps, kept, smoother);
  }
  std::vector<Pose3> truth;
  ProxyGraph graph;
  std::vector<Timestamp> stamps;
  estimation::SmootherState smoother;
  consistency::Ledger ledger;
};

// Closures at every 40th or 10th node, loose and tight: the newest node as seen from the first lies within it, and it
// is not so large that it is useless.
TEST(MapCovariance, HoldsTheErrorsOfMapsThatItSpeaksOf) {
  const PoseSigma step{0.02, 0.002};
  for (const std::size_t every : {10UL, 40UL})
    for (const PoseSigma closure : {PoseSigma{0.03, 0.003}, PoseSigma{0.2, 0.02}}) {
      const WalkWithClosures walk(240, every, step, closure);
      const Scene scene(walk, step);
      const Matrix6d covariance = scene.covariance(scene.ledger);
      const Pose3 relative = scene.truth.front().inverse() * scene.truth.back();
      constexpr int kDraws = 200;
      double sum = 0.0;
      int outside = 0;
      for (int i = 0; i < kDraws; ++i) {
        const auto drawn = walk.displace(scene.truth, Rng(5).fork(static_cast<std::uint64_t>(i)));
        const double squared = squared_distance(local(drawn.front().inverse() * drawn.back(), relative), covariance);
        sum += squared / 6.0 / kDraws;
        outside += squared > 16.8 ? 1 : 0;  // 99 % of chi-square with 6 degrees of freedom
      }
      EXPECT_GT(sum, 0.15) << every << ' ' << closure.position_m;
      EXPECT_LT(sum, 1.0) << every << ' ' << closure.position_m;
      EXPECT_LE(outside, kDraws / 50) << every << ' ' << closure.position_m;
    }
}

TEST(MapCovariance, WithoutLinksItIsOdometrys) {
  const PoseSigma step{0.02, 0.002};
  const Scene scene(WalkWithClosures(60, 10, step, {0.03, 0.003}), step);
  Matrix6d odometry = Matrix6d::Zero();
  for (const RelativePose& measured : scene.smoother.odometry)
    odometry = compound_covariance(measured.T_a_b, odometry, measured.covariance);
  EXPECT_LT((scene.covariance({}) - odometry).norm(), 1e-12 * odometry.norm());
}

TEST(MapCovariance, WhatNoLinkSpansIsOdometrys) {
  const PoseSigma step{0.02, 0.002};
  const Scene scene(WalkWithClosures(120, 10, step, {0.03, 0.003}), step);
  const Matrix6d whole = scene.covariance(scene.ledger);
  EXPECT_LT(whole.trace(), 0.5 * scene.covariance({}).trace());
  // A chain of links is as good as one; ten steps before and behind are odometry's, seen from the end.
  consistency::Ledger chain;
  auto links = scene.linked(0, 50).constraints();
  links.push_back(scene.linked(50, 119).constraints().front());
  chain.update(links, true);
  EXPECT_EQ(scene.covariance(chain), whole);
  const double open = scene.covariance(scene.linked(0, 109)).trace() + scene.covariance(scene.linked(10, 119)).trace();
  EXPECT_GT(open, 2.0 * whole.trace() + 20 * 3 * 0.02 * 0.02);
}

TEST(MapCovariance, WhatIsDoubtedIsInIt) {
  const PoseSigma step{0.02, 0.002};
  Scene scene(WalkWithClosures(120, 10, step, {0.03, 0.003}), step);
  const Matrix6d sure = scene.covariance(scene.ledger);
  const std::size_t spread = ChainUncertainty::spread(120).size();
  KnownDirection doubt{.rotation_scale = 0.1, .sigma = 3.0};
  doubt.position.assign(3 * (spread - 1), 127);  // three metres along each axis
  doubt.rotation.assign(3 * (spread - 1), 0);
  scene.graph.uncertainties[0].doubted = doubt;
  const Matrix6d added = scene.covariance(scene.ledger) - sure;
  EXPECT_NEAR(added.diagonal().head(3).sum(), 27.0, 1.0);
  EXPECT_GT(added.trace(), 26.0);
}

// The agent's own: the map's at the newest node, odometry's from there, and both again after the next graph.
TEST(MapCovariance, OfAnAgentGrowsWithOdometryAndShrinksWithTheMap) {
  RobotAgent agent(RobotId{1}, 1, {});
  const Trajectory odometry = test::drifting_odometry(260);
  test::feed(agent, {odometry.begin(), odometry.begin() + 1});
  EXPECT_EQ(agent.covariance(), Matrix6d(Matrix6d::Zero()));
  EXPECT_FALSE(agent.component().has_value());
  test::feed(agent, {odometry.begin() + 1, odometry.begin() + 240});
  const Matrix6d by_odometry = agent.covariance();
  EXPECT_GT(by_odometry(5, 5), 200 * 1e-4);
  agent.receive(test::broadcast(agent, 1, test::kWorld));
  ASSERT_GT(agent.ledger().size(), 0U);
  EXPECT_EQ(agent.component(), 0U);
  EXPECT_LT(agent.covariance().trace(), 0.01 * by_odometry.trace());
  EXPECT_GT(agent.covariance()(5, 5), 1e-6);
  Matrix6d expected = agent.covariance();
  for (int i = 240; i < 260; ++i) {
    expected = compound_covariance(odometry[i - 1].pose.inverse() * odometry[i].pose, expected, test::kStepCovariance);
    test::feed(agent, {odometry.begin() + i, odometry.begin() + i + 1});
  }
  EXPECT_LT((agent.covariance() - expected).norm(), 1e-9 * expected.norm());
}

}  // namespace map_covariance_test
}  // namespace tutti::robot
