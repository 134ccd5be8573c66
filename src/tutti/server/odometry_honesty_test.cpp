// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/odometry_honesty.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/testing/world.hpp"

namespace tutti::server {
namespace {

constexpr double kClosure_m = 0.02;
constexpr double kClosure_rad = 0.004;

Vector6d noise(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d out;
  for (int i = 0; i < 6; ++i) out(i) = rng.normal(i < 3 ? sigma_m : sigma_rad);
  return out;
}

struct Rounds {
  std::uint32_t robots = 1;
  double stated = 1.0;  ///< Standard deviations of odometry as stated, over the true ones.
  std::size_t closures = 60;
  bool between_robots = false;
};

/// Robots walking round a ring, odometry and closures with known noise.
MapEstimate walked(const Rounds& rounds, std::uint64_t seed) {
  Rng rng(seed);
  MapEstimate map;
  constexpr std::uint32_t kNodes = 200;
  std::vector<Pose3> truth;
  for (std::uint32_t r = 0; r < rounds.robots; ++r) {
    Pose3 T_odom_body;
    Pose3 T_world_body;
    for (std::uint32_t k = 0; k < kNodes; ++k) {
      if (k > 0) {
        const Pose3 step{so3_exp(Eigen::Vector3d(0, 0, 0.1)), Eigen::Vector3d(1, 0, 0)};
        const Pose3 measured = retract(step, noise(rng, 0.02, 0.004));
        T_world_body = T_world_body * step;
        T_odom_body = T_odom_body * measured;
        map.graph.edges.push_back(
            {.from = map.nodes.size() - 1,
             .to = map.nodes.size(),
             .T_from_to = measured,
             .information = test::diagonal_covariance(0.02 * rounds.stated, 0.004 * rounds.stated).inverse()});
      }
      map.nodes.push_back({.id = {RobotId{r}, k}, .T_odom_body = T_odom_body, .T_world_body = T_world_body});
      truth.push_back(T_world_body);
    }
  }
  map.odometry_edges = map.graph.edges.size();
  for (std::size_t c = 0; c < rounds.closures; ++c) {
    const auto a = static_cast<std::uint32_t>(rng.index(kNodes));
    const auto b = static_cast<std::uint32_t>((a + 40 + rng.index(kNodes - 80)) % kNodes);
    const std::uint32_t other = rounds.between_robots ? 1 : 0;
    const Pose3 T_a_b = truth[a].inverse() * truth[other * kNodes + b];
    LoopClosure closure;
    closure.from = {RobotId{0}, a};
    closure.to = {RobotId{other}, b};
    closure.measurement = {retract(T_a_b, noise(rng, kClosure_m, kClosure_rad)),
                           test::diagonal_covariance(kClosure_m, kClosure_rad)};
    map.closures.push_back({closure, true});
  }
  return map;
}

TEST(OdometryHonesty, HonestOdometryIsTakenAtItsWord) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    EXPECT_GT(odometry_variance_factors(walked({}, seed)).at(RobotId{0}), 0.5) << "seed " << seed;
}

TEST(OdometryHonesty, OverstatedOdometryIsSeenThrough) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const double factor = odometry_variance_factors(walked({.stated = 4.0}, seed)).at(RobotId{0});
    EXPECT_GT(factor, 0.5 / 16.0) << "seed " << seed;
    EXPECT_LT(factor, 2.0 / 16.0) << "seed " << seed;
  }
}

TEST(OdometryHonesty, LoopsThroughAnotherRobotCountForBoth) {
  const auto factors = odometry_variance_factors(walked({.robots = 2, .stated = 4.0, .between_robots = true}, 4));
  for (const auto& [robot, factor] : factors) {
    EXPECT_GT(factor, 0.4 / 16.0);
    EXPECT_LT(factor, 2.5 / 16.0);
  }
}

TEST(OdometryHonesty, StaysWithinItsBounds) {
  EXPECT_EQ(odometry_variance_factors(walked({.stated = 4.0, .closures = 7}, 1)).at(RobotId{0}), 1.0);  // too few
  EXPECT_EQ(odometry_variance_factors(walked({.stated = 0.2}, 1)).at(RobotId{0}), 1.0);  // understated: not ours
  EXPECT_GE(odometry_variance_factors(walked({.stated = 100.0}, 1)).at(RobotId{0}), 0.04);
  EXPECT_TRUE(odometry_variance_factors({}).empty());
}

/// The map puts another motion in the place of a step that jumped; raw odometry still has the jump.
TEST(OdometryHonesty, LoopsOverFailedOdometryDoNotCount) {
  auto map = walked({.stated = 4.0, .closures = 120}, 5);
  const Pose3 jump{so3_exp(Eigen::Vector3d(0, 0, 0.3)), Eigen::Vector3d(3, -2, 0)};
  const Pose3 before = map.nodes[99].T_odom_body;
  for (std::size_t i = 100; i < map.nodes.size(); ++i)
    map.nodes[i].T_odom_body = before * jump * before.inverse() * map.nodes[i].T_odom_body;
  map.failed_odometry = {{RobotId{0}, 99, 100, jump.translation.norm(), 0.3}};
  EXPECT_LT(odometry_variance_factors(map).at(RobotId{0}), 2.5 / 16.0);
}

TEST(OdometryHonesty, RefusedClosuresDoNotCount) {
  auto map = walked({.stated = 4.0}, 1);
  for (JudgedClosure& judged : map.closures) judged.accepted = false;
  EXPECT_EQ(odometry_variance_factors(map).at(RobotId{0}), 1.0);
}

}  // namespace
}  // namespace tutti::server
