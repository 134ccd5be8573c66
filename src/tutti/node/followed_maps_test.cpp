// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/followed_maps.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "support/consistency/uncertainty.hpp"

namespace tutti::node {
namespace followed_maps_test {

using namespace consistency;  // NOLINT: its test support
using consistency::test::kBravo;

constexpr std::size_t kNodes = 160;  // round a corner: along a line, what lies aside of it may be turned about it

/// The map, in which the second half of the robot's trajectory lies `aside` of where odometry has it.
ProxyGraph map_with(double aside_m, const ChainId& chain = {kBravo, 1}) {
  static const consistency::test::WalkWithClosures errors{kNodes, 20, {0.01, 5e-4}, {0.02, 2e-3}};
  std::vector<Pose3> poses = consistency::test::corridor(kNodes);
  for (std::size_t n = kNodes / 2; n < kNodes; ++n) poses[n].translation.y() += aside_m;
  auto nodes = consistency::test::server_nodes(chain.robot, poses);
  for (consistency::ServerNode& node : nodes) node.chain = chain;
  ProxyGraph graph = consistency::build_proxy_graph(1, std::move(nodes), {}, {});
  graph.uncertainties = {errors.uncertainty(graph, chain)};
  return graph;
}

constexpr double kEvery_s = 20.0;

class FollowedMapsTest : public testing::Test {
 protected:
  /// The map takes so many segments of the robot's odometry to have failed, and has so many closures of it.
  struct What {
    std::size_t failed = 0;
    std::size_t closures = 0;
  };
  FollowedMaps::Decision take(ProxyGraph map, const What& what = {0, 0}, bool at_once = false) {
    return maps_.take(kBravo, of(std::move(map), what), at_once, now_);
  }
  static FollowedMaps::Map of(ProxyGraph map, const What& what) {
    const ChainId chain = map.nodes.back().chain;
    server::Beliefs beliefs;
    for (std::uint32_t i = 0; i < what.failed; ++i) beliefs.failed_odometry.push_back({chain, 10 * i, 10 * i + 5});
    for (std::uint32_t i = 0; i < what.closures; ++i) beliefs.accepted.insert({{chain, i}, {chain, 100 + i}});
    return {std::move(map), std::make_shared<const server::Beliefs>(std::move(beliefs))};
  }
  FollowedMaps maps_{kEvery_s};
  Timestamp now_;
};

TEST_F(FollowedMapsTest, TheFirstMapIsSentAndOthersThatConcernTheRobot) {
  EXPECT_TRUE(take(map_with(0.0)).send);
  EXPECT_FALSE(take(map_with(0.0)).send);
  EXPECT_TRUE(take(map_with(0.0), {.closures = 1}).send);
  EXPECT_FALSE(take(map_with(0.0), {.closures = 1}).send);
  EXPECT_TRUE(take(map_with(0.0), {.closures = 0}).send);
  EXPECT_TRUE(take(map_with(0.0), {.failed = 1}).send);
}

TEST_F(FollowedMapsTest, AMapThatLiesElsewhereByMoreThanOneSigmaIsSent) {
  take(map_with(0.0));
  const ProxyGraph followed = map_with(0.0);
  const double per_metre = map_change(followed, map_with(0.01), {kBravo, 1}).significance / 0.01;
  EXPECT_FALSE(take(map_with(0.3 / per_metre)).send);
  EXPECT_TRUE(take(map_with(0.4 / per_metre)).send);
}

// So robots hear of their last submaps, and of the others.
TEST_F(FollowedMapsTest, WhatDoesNotConcernTheRobotIsSentLater) {
  take(map_with(0.0));
  const Timestamp sent = now_;
  EXPECT_EQ(maps_.next_review(), std::nullopt);
  now_ = sent + 1.0;
  EXPECT_FALSE(take(map_with(0.0)).send);
  EXPECT_EQ(maps_.next_review(), sent + kEvery_s);
  EXPECT_FALSE(maps_.follow(kBravo, sent + (kEvery_s - 1.0)));
  EXPECT_TRUE(maps_.follow(kBravo, sent + kEvery_s));
  EXPECT_FALSE(maps_.follow(kBravo, sent + kEvery_s));
  EXPECT_EQ(maps_.next_review(), std::nullopt);
  now_ = sent + (kEvery_s + 10.0);
  EXPECT_FALSE(take(map_with(0.0)).send);
  now_ = sent + 2.0 * kEvery_s;
  EXPECT_TRUE(take(map_with(0.0)).send);
}

TEST_F(FollowedMapsTest, AMapThatHasChangedItsMindIsSentAtOnceAndSaysSo) {
  EXPECT_FALSE(take(map_with(0.0)).changed.has_value());
  const auto first = take(map_with(2.0), {.closures = 3});
  EXPECT_TRUE(first.send);
  ASSERT_TRUE(first.changed.has_value());
  EXPECT_EQ(first.changed->robot, kBravo);
  EXPECT_GT(first.changed->change.significance, 1.0);
  EXPECT_EQ(first.changed->reason.found, 3U);
  EXPECT_FALSE(take(map_with(2.0), {.closures = 3}).changed.has_value());
}

TEST_F(FollowedMapsTest, WithoutAPauseEveryMapIsSent) {
  FollowedMaps every(0.0);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(every.take(kBravo, of(map_with(0.0), {0, 0}), false, now_).send);
  EXPECT_EQ(every.next_review(), std::nullopt);
}

TEST_F(FollowedMapsTest, WhatAnOperatorDecidedIsSentAtOnce) {
  take(map_with(0.0));
  EXPECT_TRUE(take(map_with(0.0), {}, true).send);
}

TEST_F(FollowedMapsTest, ANewSessionIsAnotherTrajectory) {
  take(map_with(0.0));
  const auto other = take(map_with(2.0, {kBravo, 2}));
  EXPECT_TRUE(other.send);
  EXPECT_FALSE(other.changed.has_value());
}

}  // namespace followed_maps_test
}  // namespace tutti::node
