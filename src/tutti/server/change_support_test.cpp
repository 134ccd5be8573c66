// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/change_support.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::server {
namespace change_support_test {

const ChainId kAlpha{RobotId{0}, 1};
constexpr std::size_t kRound = 60;  // steps of 1 m in 1 s round a block
constexpr std::size_t kNodes = 3 * kRound;

Pose3 on_the_way(std::size_t n) {
  const double angle = 2.0 * M_PI * static_cast<double>(n) / kRound, radius = kRound / (2.0 * M_PI);
  return {so3_exp({0, 0, angle}), {radius * std::sin(angle), radius * (1.0 - std::cos(angle)), 0.0}};
}

/// Where the robot was: its odometry missed a slip of `off_m` after the first round.
Pose3 in_truth(std::size_t n, double off_m) {
  Pose3 out = on_the_way(n);
  if (n >= kRound) out.translation.y() += off_m;
  return out;
}

/// Rounds of a block; the map knows where odometry failed. At each of `places` (nodes) of the first round three
/// neighbouring closures with the second one.
MapEstimate map_with(const std::vector<std::size_t>& places, double off_m) {
  MapEstimate map;
  const Matrix6d information = Matrix6d::Identity() * 1e4;
  for (std::size_t n = 0; n < kNodes; ++n) {
    map.nodes.push_back({{kAlpha, static_cast<std::uint32_t>(n)},
                         Timestamp{} + static_cast<double>(n),
                         true,
                         on_the_way(n),
                         on_the_way(n),
                         0});
    map.graph.poses.push_back(on_the_way(n));
    if (n > 0)
      map.graph.edges.push_back({.from = n - 1,
                                 .to = n,
                                 .T_from_to = on_the_way(n - 1).inverse() * on_the_way(n),
                                 .information = (n == kRound ? 1e-6 : 1.0) * information});
  }
  map.odometry_edges = map.graph.edges.size();
  for (const std::size_t place : places)
    for (std::size_t k = place; k < place + 3; ++k) {
      const std::size_t to = k + kRound;
      map.graph.edges.push_back({.from = k,
                                 .to = to,
                                 .T_from_to = in_truth(k, off_m).inverse() * in_truth(to, off_m),
                                 .information = information});
      map.closures.push_back({.closure = {map.nodes[k].id, map.nodes[to].id, {}}, .accepted = true});
    }
  estimation::SolverConfig given;
  given.initialisation = "given";
  map.graph.poses = estimation::solve_pose_graph(map.graph, given).poses;
  return map;
}

ProxyGraph part_of(const MapEstimate& map) {
  ProxyGraph out;
  for (std::size_t n = 0; n < map.nodes.size(); ++n)
    out.nodes.push_back({kAlpha, map.nodes[n].stamp, map.graph.poses[n]});
  out.uncertainties.push_back({.chain = kAlpha});
  return out;
}

ChangeSupport support(const MapEstimate& map, const Beliefs& followed = {}) {
  return change_support(map, followed, part_of(map_with({}, 0.0)), part_of(map), kAlpha, {});
}

TEST(ChangeSupport, OnePlaceCarriesItAndTwoThatAgreeDoNot) {
  EXPECT_EQ(support(map_with({10}, 20.0)).lone_closures, 3U);
  EXPECT_EQ(support(map_with({10, 40}, 20.0)).lone_closures, 0U);
  EXPECT_EQ(support(map_with({10, 18}, 20.0)).lone_closures, 6U);  // neighbours are one witness
}

TEST(ChangeSupport, ClosuresThatTheFollowedMapHadAreNotTriedBesideNewOnes) {
  const MapEstimate map = map_with({10, 40}, 20.0);
  Beliefs followed = beliefs_of(map_with({10}, 20.0));
  EXPECT_EQ(support(map, followed).lone_closures, 0U);
  // Nothing is new: what was accepted before may carry it.
  const MapEstimate one = map_with({10}, 20.0);
  EXPECT_EQ(support(one, beliefs_of(one)).lone_closures, 3U);
}

TEST(ChangeSupport, AMapWithoutClosuresRestsOnNone) {
  EXPECT_EQ(support(map_with({}, 0.0)).lone_closures, 0U);
  EXPECT_EQ(support(map_with({}, 0.0)).factorisations, 0);
}

// A group costs a few steps from where the map is.
TEST(ChangeSupport, CostsAFewStepsAGroup) {
  const ChangeSupport out = support(map_with({0, 17, 34, 51}, 5.0));
  EXPECT_EQ(out.lone_closures, 0U);
  EXPECT_LE(out.factorisations, 8 * 4);
}

// In a large map nearly all groups are far away, or agree.
TEST(ChangeSupport, GroupsThatHardlyMoveTheChainAreNotTried) {
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < kRound - 8; place += 11) places.push_back(place);
  const ChangeSupport many = support(map_with(places, 5.0));
  EXPECT_EQ(many.lone_closures, 0U);
  EXPECT_LE(many.tried, 1);
  EXPECT_LE(many.factorisations, 8);
  const ChangeSupport one = support(map_with({10}, 5.0));
  EXPECT_EQ(one.tried, 1);
}

/// A street that was driven twice, with loose odometry: each of `places` says that the second time was beside the first
/// one, to the other side than the place before it.
MapEstimate zigzag(std::size_t places) {
  constexpr std::size_t kApart = 50;
  const std::size_t once = kApart * (places + 1);
  const auto pose = [&](std::size_t n) { return Pose3{{}, {static_cast<double>(n % once), 0.0, 0.0}}; };
  MapEstimate map;
  for (std::size_t n = 0; n < 2 * once; ++n) {
    map.nodes.push_back({{kAlpha, static_cast<std::uint32_t>(n)}, Timestamp{} + static_cast<double>(n), true, pose(n)});
    map.graph.poses.push_back(pose(n));
    if (n > 0) map.graph.edges.push_back({n - 1, n, pose(n - 1).inverse() * pose(n), Matrix6d::Identity()});
  }
  map.odometry_edges = map.graph.edges.size();
  for (std::size_t p = 0; p < places; ++p)
    for (std::size_t k = kApart * (p + 1); k < kApart * (p + 1) + 3; ++k)
      map.graph.edges.push_back({k, k + once, {{}, {0.0, p % 2 == 0 ? 2.0 : -2.0, 0.0}}, Matrix6d::Identity() * 1e4});
  estimation::SolverConfig given;
  given.initialisation = "given";
  map.graph.poses = estimation::solve_pose_graph(map.graph, given).poses;
  return map;
}

TEST(ChangeSupport, HoweverManyGroupsMoveTheChainFewAreTried) {
  const ChangeSupport few = change_support(zigzag(10), {}, part_of(zigzag(0)), part_of(zigzag(10)), kAlpha, {});
  EXPECT_EQ(few.tried, 10);
  const ChangeSupport many = change_support(zigzag(30), {}, part_of(zigzag(0)), part_of(zigzag(30)), kAlpha, {});
  EXPECT_EQ(many.tried, 16);
  EXPECT_EQ(many.lone_closures, 0U);
}

}  // namespace change_support_test
}  // namespace tutti::server
