// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/change_watch.hpp"

#include <gtest/gtest.h>

#include <cstdint>
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
  /// Ten seconds after the last one: a map with one more submap of the robot, or without. It rests on so many closures
  /// of one place, and takes so many segments of the robot's odometry to have failed.
  struct What {
    bool has_more = true;
    std::size_t lone = 0;
    std::size_t failed = 0;
    std::size_t closures = 0;
  };
  ChangeWatch::Decision take(const ProxyGraph& map) { return take(map, {}); }
  ChangeWatch::Decision take(ProxyGraph map, const What& what) {
    now_ = now_ + 10.0;
    return take_now(std::move(map), what);
  }
  ChangeWatch::Decision take_now(ProxyGraph map, const What& what) {
    const auto lone = [&](const ChangeWatch::Map&, const ProxyGraph&) { return what.lone; };
    return watch_.take(kBravo, of(std::move(map), what), lone, now_);
  }
  ChangeWatch::Map of(ProxyGraph map, const What& what) {
    if (what.has_more) ++submaps_;
    map.nodes.back().stamp = map.nodes.back().stamp + 1e-3 * submaps_;
    const ChainId chain = map.nodes.back().chain;
    server::Beliefs beliefs;
    for (std::uint32_t i = 0; i < what.failed; ++i) beliefs.failed_odometry.push_back({chain, 10 * i, 10 * i + 5});
    for (std::uint32_t i = 0; i < what.closures; ++i) beliefs.accepted.insert({{chain, i}, {chain, 100 + i}});
    return {std::move(map), std::make_shared<const server::Beliefs>(std::move(beliefs))};
  }
  /// What is reported, one outcome at most.
  static std::optional<ChangeOutcome> reported(const ChangeWatch::Decision& decision) {
    EXPECT_LE(decision.reports.size(), 1U);
    return decision.reports.empty() ? std::nullopt : std::optional(decision.reports.front().outcome);
  }
  ChangeWatch watch_;
  Timestamp now_;
  int submaps_ = 0;
};

TEST_F(ChangeWatchTest, TheFirstMapIsSentAndOthersThatConcernTheRobot) {
  EXPECT_TRUE(take(map_with(0.0)).send);
  EXPECT_FALSE(take_now(map_with(0.0), {}).send);  // another submap, of which nothing is known but odometry
  EXPECT_TRUE(take_now(map_with(0.0), {.closures = 1}).send);
  EXPECT_FALSE(take_now(map_with(0.0), {.closures = 1}).send);
  EXPECT_TRUE(take_now(map_with(0.0), {.closures = 0}).send);
  EXPECT_TRUE(take_now(map_with(0.0), {.failed = 1}).send);
}

TEST_F(ChangeWatchTest, AMapThatLiesElsewhereByMoreThanOneSigmaIsSent) {
  take(map_with(0.0));
  const ProxyGraph followed = map_with(0.0);
  const double per_metre = map_change(followed, map_with(0.01), {kBravo, 1}).significance / 0.01;
  EXPECT_FALSE(take_now(map_with(0.3 / per_metre), {}).send);
  EXPECT_TRUE(take_now(map_with(0.4 / per_metre), {}).send);
}

// So robots hear of their last submaps, and of the others.
TEST_F(ChangeWatchTest, WhatDoesNotConcernTheRobotIsSentLater) {
  take(map_with(0.0));
  const Timestamp sent = now_;
  EXPECT_EQ(watch_.next_review(), std::nullopt);
  EXPECT_FALSE(take(map_with(0.0)).send);
  EXPECT_EQ(watch_.next_review(), sent + ChangeWatch::kAnyway_s);
  EXPECT_FALSE(watch_.follow(kBravo, sent + (ChangeWatch::kAnyway_s - 1.0)).has_value());
  const auto late = watch_.follow(kBravo, sent + ChangeWatch::kAnyway_s);
  ASSERT_TRUE(late.has_value());
  EXPECT_FALSE(late->report.has_value());
  EXPECT_EQ(watch_.next_review(), std::nullopt);
  now_ = sent + ChangeWatch::kAnyway_s;
  EXPECT_FALSE(take(map_with(0.0)).send);
  EXPECT_TRUE(take(map_with(0.0)).send);
}

TEST_F(ChangeWatchTest, AChangeStandsWhenMoreAboutTheRobotSaysTheSame) {
  take(map_with(0.0));
  const auto first = take(map_with(2.0));
  EXPECT_FALSE(first.send);
  EXPECT_EQ(reported(first), ChangeOutcome::waits);
  EXPECT_GT(first.reports[0].change.significance, 1.0);
  EXPECT_FALSE(take_now(map_with(2.1), {.has_more = false}).send);  // half a second later, of somebody else
  const auto second = take_now(map_with(2.1), {});
  EXPECT_TRUE(second.send);
  EXPECT_EQ(reported(second), ChangeOutcome::stands);
  EXPECT_EQ(reported(take(map_with(2.1))), std::nullopt);
}

TEST_F(ChangeWatchTest, AChangeThatIsTakenBackIsNeverSent) {
  take(map_with(0.0));
  for (int flip = 0; flip < 5; ++flip) {
    EXPECT_FALSE(take(map_with(2.0)).send);
    EXPECT_EQ(reported(take(map_with(0.0))), ChangeOutcome::gone);
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

TEST_F(ChangeWatchTest, WithoutMoreAboutTheRobotItStandsSoon) {
  take(map_with(0.0));
  EXPECT_FALSE(watch_.follow(kBravo, now_).has_value());
  EXPECT_FALSE(take(map_with(2.0)).send);
  EXPECT_EQ(watch_.next_review(), now_ + ChangeWatch::kStands_s);
  now_ = now_ + ChangeWatch::kStands_s;
  EXPECT_EQ(watch_.follow(kBravo, now_)->report->outcome, ChangeOutcome::stands);
  EXPECT_EQ(watch_.next_review(), std::nullopt);
  EXPECT_EQ(reported(take_now(map_with(2.0), {})), std::nullopt);
}

TEST_F(ChangeWatchTest, WithOthersNewsAloneItStandsAsSoon) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0)).send);
  EXPECT_TRUE(take(map_with(2.0), {.has_more = false}).send);
}

// The robot stays where it was meanwhile, and one change only is reported.
TEST_F(ChangeWatchTest, WhatRestsOnOnePlaceAgainstOdometryWaitsForAnotherPlace) {
  take(map_with(0.0));
  const auto first = take(map_with(2.0), {.lone = 4, .failed = 1});
  EXPECT_EQ(reported(first), ChangeOutcome::waits);
  EXPECT_EQ(first.reports[0].reason.lone, 4U);
  const Timestamp at_last = now_ + ChangeWatch::kWitness_s;
  while (now_ + 10.0 < at_last) {
    const auto next = take(map_with(2.1), {.lone = 5, .failed = 1});
    EXPECT_FALSE(next.send);
    EXPECT_EQ(reported(next), std::nullopt);
    EXPECT_EQ(watch_.next_review(), at_last);
    EXPECT_FALSE(watch_.follow(kBravo, now_).has_value());
  }
  const auto last = take(map_with(2.1), {.failed = 1});
  EXPECT_TRUE(last.send);
  EXPECT_EQ(reported(last), ChangeOutcome::stands);
}

TEST_F(ChangeWatchTest, WhereThereNeverIsAnotherPlaceItStandsAtLast) {
  take(map_with(0.0));
  const auto first = take(map_with(2.0), {.lone = 4, .failed = 1});
  EXPECT_FALSE(watch_.follow(kBravo, now_ + (ChangeWatch::kWitness_s - 1.0)).has_value());
  const auto late = watch_.follow(kBravo, now_ + ChangeWatch::kWitness_s);
  ASSERT_TRUE(late.has_value());
  EXPECT_EQ(late->report->outcome, ChangeOutcome::stands);
}

TEST_F(ChangeWatchTest, WhatRestsOnOnePlaceAndAgreesWithOdometryStandsAsOthersDo) {
  take(map_with(0.0));
  EXPECT_FALSE(take(map_with(2.0), {.lone = 4}).send);
  EXPECT_TRUE(take(map_with(2.0), {.lone = 4}).send);
}

TEST_F(ChangeWatchTest, WhoeverDoesNotWaitIsSentItAtOnce) {
  take(map_with(0.0));
  EXPECT_TRUE(watch_.take(kBravo, of(map_with(2.0), {}), nullptr, now_).send);
  EXPECT_TRUE(watch_.take(kBravo, of(map_with(2.0), {}), nullptr, now_).send);
}

TEST_F(ChangeWatchTest, ANewSessionIsAnotherTrajectory) {
  take(map_with(0.0));
  EXPECT_TRUE(take_now(map_with(2.0, {kBravo, 2}), {}).send);
}

}  // namespace change_watch_test
}  // namespace tutti::node
