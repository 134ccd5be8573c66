// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/change_watch.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "support/consistency/uncertainty.hpp"

namespace tutti::node {
namespace change_watch_test {

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

class ChangeWatchTest : public testing::Test {
 protected:
  /// Ten seconds after the last one; a map that rests on so many closures of one place.
  ChangeWatch::Decision take(const ProxyGraph& map, std::size_t lone_closures = 0) {
    const auto lone = [&](const ChangeWatch::Map&, const ProxyGraph&) { return lone_closures; };
    return watch_.take(kBravo, {map, std::make_shared<const server::Beliefs>()}, lone, now_ = now_ + 10.0);
  }
  /// What is reported, one outcome at most.
  static std::optional<ChangeOutcome> reported(const ChangeWatch::Decision& decision) {
    EXPECT_LE(decision.reports.size(), 1U);
    return decision.reports.empty() ? std::nullopt : std::optional(decision.reports.front().outcome);
  }
  ChangeWatch watch_;
  Timestamp now_;
};

TEST_F(ChangeWatchTest, TheFirstMapAndThoseLikeItAreSent) {
  for (const double aside_m : {0.0, 0.01, 0.02}) {
    const auto decision = take(map_with(aside_m));
    EXPECT_TRUE(decision.send);
    EXPECT_EQ(reported(decision), std::nullopt);
  }
  EXPECT_FALSE(watch_.anything_waits());
}

TEST_F(ChangeWatchTest, AChangeThatStandsIsSentOneUpdateLater) {
  take(map_with(0.0));
  const auto first = take(map_with(2.0));
  EXPECT_FALSE(first.send);
  EXPECT_EQ(reported(first), ChangeOutcome::waits);
  EXPECT_GT(first.reports[0].change.significance, 1.0);
  EXPECT_TRUE(watch_.anything_waits());
  const auto second = take(map_with(2.1));
  EXPECT_TRUE(second.send);
  EXPECT_EQ(reported(second), ChangeOutcome::stands);
  EXPECT_EQ(reported(take(map_with(2.1))), std::nullopt);
}

TEST_F(ChangeWatchTest, AChangeThatIsTakenBackIsNeverSent) {
  take(map_with(0.0));
  for (int flip = 0; flip < 5; ++flip) {
    EXPECT_FALSE(take(map_with(2.0)).send);
    const auto back = take(map_with(0.0));
    EXPECT_TRUE(back.send);
    EXPECT_EQ(reported(back), ChangeOutcome::gone);
  }
}

// Even where it goes on changing, as odometry that is far too sure makes it: what came nearer stands.
TEST_F(ChangeWatchTest, AMapThatGoesOnInTheSameDirectionIsFollowed) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0)).send);
  EXPECT_TRUE(take(map_with(3.5)).send);
}

TEST_F(ChangeWatchTest, AThirdOpinionWaitsAnew) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0)).send);
  const auto other = take(map_with(-1.5));
  EXPECT_FALSE(other.send);
  ASSERT_EQ(other.reports.size(), 2U);
  EXPECT_EQ(other.reports[0].outcome, ChangeOutcome::gone);
  EXPECT_EQ(other.reports[1].outcome, ChangeOutcome::waits);
  EXPECT_TRUE(take(map_with(-1.5)).send);
}

TEST_F(ChangeWatchTest, AnUpdateWithoutNewsLetsItStand) {
  take(map_with(0.0));
  EXPECT_FALSE(watch_.follow(kBravo, now_).has_value());
  EXPECT_FALSE(take(map_with(2.0)).send);
  EXPECT_EQ(watch_.follow(kBravo, now_ + ChangeWatch::kAnother_s)->outcome, ChangeOutcome::stands);
  EXPECT_FALSE(watch_.anything_waits());
  EXPECT_TRUE(take(map_with(2.0)).send);
}

// The robot stays where it was for two minutes, whether or not there is news, and one change only is reported.
TEST_F(ChangeWatchTest, WhatRestsOnOnePlaceStandsForMinutes) {
  take(map_with(0.0));
  const auto first = take(map_with(2.0), 4);
  EXPECT_EQ(reported(first), ChangeOutcome::waits);
  EXPECT_EQ(first.reports[0].reason.lone, 4U);
  for (const Timestamp since = now_; now_ - since < ChangeWatch::kStands_s - 10.0;) {
    const auto next = take(map_with(2.1), 5);
    EXPECT_FALSE(next.send);
    EXPECT_EQ(reported(next), std::nullopt);
    EXPECT_FALSE(watch_.follow(kBravo, now_).has_value());
  }
  const auto last = take(map_with(2.1), 6);
  EXPECT_TRUE(last.send);
  EXPECT_EQ(reported(last), ChangeOutcome::stands);
  EXPECT_EQ(last.reports[0].reason.lone, 5U);  // of the map that waited
}

TEST_F(ChangeWatchTest, ASecondPlaceThatSaysTheSameEndsTheWait) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0), 4).send);
  EXPECT_FALSE(take(map_with(2.0), 4).send);
  EXPECT_TRUE(take(map_with(2.0), 0).send);
}

TEST_F(ChangeWatchTest, WithoutNewsItIsFollowedAfterMinutes) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0), 4).send);
  EXPECT_FALSE(watch_.follow(kBravo, now_ + (ChangeWatch::kStands_s - 1.0)).has_value());
  EXPECT_TRUE(watch_.anything_waits());
  EXPECT_EQ(watch_.follow(kBravo, now_ + ChangeWatch::kStands_s)->outcome, ChangeOutcome::stands);
}

TEST_F(ChangeWatchTest, WhoeverDoesNotWaitIsSentItAtOnce) {
  take(map_with(0.0));
  EXPECT_TRUE(watch_.take(kBravo, {map_with(2.0), std::make_shared<const server::Beliefs>()}, nullptr, now_).send);
  EXPECT_TRUE(take(map_with(2.0)).send);
}

TEST_F(ChangeWatchTest, ANewSessionIsAnotherTrajectory) {
  take(map_with(0.0));
  EXPECT_TRUE(take(map_with(2.0, {kBravo, 2})).send);
}

}  // namespace change_watch_test
}  // namespace tutti::node
