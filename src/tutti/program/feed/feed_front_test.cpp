// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_front.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <thread>

#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {
namespace feed_front_test {

const Trajectory kOdometry = robot::test::drifting_odometry(400);

OdometrySample sample(std::size_t i) { return {kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}; }

Scan scan(std::size_t i, std::size_t points = 10) {
  PointCloud cloud;
  cloud.points.assign(points, Eigen::Vector3f(1.0F, 2.0F, static_cast<float>(i)));
  return {kOdometry[i].stamp, std::make_shared<const PointCloud>(std::move(cloud)), {}};
}

Status give(test::NodeTarget& robot, const FeedInput& input) {
  if (const auto* anew = std::get_if<FeedAnew>(&input)) return robot.begin_session(anew->why);
  if (const auto* of_robot = std::get_if<Input>(&input)) return robot.add(*of_robot);
  return robot.finish();
}

/// Every `every`-th.
Status give_scan(FeedTarget& robot, std::size_t i, std::size_t every) {
  return i % every == 0 ? robot.add(scan(i)) : Status();
}

/// A robot that takes what the front has, as far as it is let.
struct Behind {
  explicit Behind(const FeedFront::Limits& limits = {}) : front(robot.state(), limits) {}
  /// Returns what it took.
  std::size_t work(std::size_t most = 1'000'000) {
    std::size_t count = 0;
    for (; count < most; ++count) {
      const auto input = front.take(0.0);
      if (!input) break;
      EXPECT_TRUE(give(robot, *input));
      front.note_heard();
    }
    front.note_stored();
    front.publish(robot.state());
    return count;
  }
  test::NodeTarget robot;
  FeedFront front;
};

TEST(FeedFront, AnswersWhatTheRobotWouldHaveAnsweredWhileItIsBehind) {
  Behind behind;
  test::NodeTarget other;  // that answers at once
  for (std::size_t i = 0; i < 300; ++i) {
    ASSERT_TRUE(behind.front.add(sample(i)));
    ASSERT_TRUE(other.add(sample(i)));
    const FeedState state = behind.front.state(), expected = other.state();
    ASSERT_EQ(state.newest->stamp, expected.newest->stamp);
    ASSERT_LT(local(state.newest->pose, expected.newest->pose).norm(), 1e-12) << i;
    ASSERT_TRUE(state.covariance.isApprox(expected.covariance, 1e-9)) << i;
    ASSERT_TRUE(state.wants_scan || !expected.wants_scan) << i;
    ASSERT_TRUE(state.alerts.empty());
    ASSERT_TRUE(give_scan(behind.front, i, 7));
    ASSERT_TRUE(give_scan(other, i, 7));
    if (i % 50 == 20) behind.work(15);
  }
  behind.work();
  EXPECT_EQ(behind.robot.node().agent().keyframes(), other.node().agent().keyframes());
  EXPECT_EQ(behind.front.state().wants_scan, other.state().wants_scan);
}

// The client's front end begins anew and jumps, also several times before the robot hears of it.
TEST(FeedFront, SeesWhereOdometryJumpsAsTheRobotDoes) {
  Behind behind;
  test::NodeTarget other;  // that answers at once
  Pose3 T_fed_odom;
  const Pose3 elsewhere{Eigen::Quaterniond(0.6, 0.0, 0.0, 0.8), {300.0, -500.0, 20.0}};
  for (std::size_t i = 0; i < 300; ++i) {
    if (i == 100) T_fed_odom = kOdometry[i].pose.inverse();
    if (i == 105 || i == 200) T_fed_odom = elsewhere * T_fed_odom;
    OdometrySample fed = sample(i);
    fed.T_odom_body = T_fed_odom * fed.T_odom_body;
    ASSERT_TRUE(behind.front.add(fed));
    ASSERT_TRUE(other.add(fed));
    const FeedState state = behind.front.state(), expected = other.state();
    ASSERT_EQ(state.newest, expected.newest) << i;
    ASSERT_LT(local(state.T_odom_fed, expected.T_odom_fed).norm(), 1e-9) << i;
    ASSERT_LT(local(state.T_map_odom, expected.T_map_odom).norm(), 1e-9) << i;
    ASSERT_TRUE(state.covariance.isApprox(expected.covariance, 1e-9)) << i;
    ASSERT_TRUE(state.wants_scan || !expected.wants_scan) << i;
    if (i % 41 == 0) behind.work(30);
  }
  ASSERT_GT(behind.front.state().T_odom_fed.translation.norm(), 100.0);
}

TEST(FeedFront, WhatIsTakenTogetherIsNeverAcrossAJump) {
  Behind behind({.inputs = 40});
  for (std::size_t i = 0; i < 400; ++i) {
    OdometrySample fed = sample(i);
    if (i >= 123) fed.T_odom_body.translation.x() += 100.0;
    ASSERT_TRUE(behind.front.add(fed));
  }
  std::optional<Timestamp> before;
  bool is_there = false;
  while (const auto input = behind.front.take(0.0)) {
    const auto& one = *sample_in<OdometrySample>(*input);
    if (one.stamp == kOdometry[123].stamp) {
      is_there = true;
      EXPECT_EQ(before, kOdometry[122].stamp);
    }
    before = one.stamp;
  }
  EXPECT_TRUE(is_there);
}

TEST(FeedFront, CarriesOnFromTheLastCorrection) {
  Behind behind;
  for (std::size_t i = 0; i < 200; ++i) ASSERT_TRUE(behind.front.add(sample(i)));
  behind.work(150);
  const auto graph = robot::test::broadcast(behind.robot.node().agent(), 1, robot::test::kWorld);
  behind.robot.receive({bus::Endpoint::server(),
                        bus::Endpoint::of(RobotId{1}),
                        bus::MessageKind::proxy_graph,
                        {},
                        std::make_shared<const std::string>(wire::encode(graph))});
  const Pose3 T_map_odom = behind.robot.node().agent().T_map_odom();
  ASSERT_GT(local(T_map_odom, Pose3{}).norm(), 0.1);
  behind.front.publish(behind.robot.state());
  const FeedState state = behind.front.state();
  EXPECT_EQ(state.T_map_odom, T_map_odom);
  EXPECT_EQ(state.newest->stamp, kOdometry[199].stamp);
  EXPECT_GT(state.covariance(0, 0), behind.robot.state().covariance(0, 0));
  behind.work();
  EXPECT_TRUE(behind.front.state().covariance.isApprox(state.covariance, 1e-9));
}

TEST(FeedFront, RefusesWhatTheRobotWouldRefuseAtOnce) {
  Behind behind;
  test::NodeTarget robot;
  ASSERT_TRUE(behind.front.add(sample(1)));
  ASSERT_TRUE(robot.add(sample(1)));
  std::vector<OdometrySample> bad(6, sample(2));
  bad[0].stamp = sample(1).stamp;
  bad[1].T_odom_body.translation.x() = std::numeric_limits<double>::quiet_NaN();
  bad[2].T_odom_body.translation.x() = 1e300;
  bad[3].T_odom_body.rotation.coeffs() *= 1.1;
  bad[4].increment_covariance(0, 0) = -1.0;
  bad[5].increment_covariance(0, 1) = 1.0;
  for (const OdometrySample& one : bad) {
    const Status by_front = behind.front.add(one), by_robot = robot.add(one);
    ASSERT_FALSE(by_front);
    ASSERT_FALSE(by_robot);
    EXPECT_EQ(by_front.error().message, by_robot.error().message);
  }
  EXPECT_EQ(behind.work(), 1U);
}

TEST(FeedFront, WhatIsTooMuchCostsTheMapNotTheTrajectory) {
  Behind behind({.inputs = 50, .scan_bytes = 3 * 120});
  std::size_t refused = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    ASSERT_TRUE(behind.front.add(sample(i)));
    const Status taken = behind.front.add(scan(i));
    if (!taken) ++refused;
    EXPECT_TRUE(taken || taken.error().message.find("left out") != std::string::npos);
    ASSERT_EQ(behind.front.state().newest->stamp, kOdometry[i].stamp);
    ASSERT_LE(behind.front.load().waiting, 50U);
  }
  EXPECT_EQ(refused, 297U);
  EXPECT_EQ(behind.front.load().scans_left_out, 297U);
  const FeedState state = behind.front.state();
  ASSERT_EQ(state.alerts.size(), 1U);
  EXPECT_NE(state.alerts[0].text.find("odometry is taken together"), std::string::npos) << state.alerts[0].text;
  EXPECT_GT(behind.work(), 25U);
  const FeedState caught_up = behind.front.state();
  EXPECT_TRUE(caught_up.alerts.empty());
  EXPECT_EQ(caught_up.newest->stamp, state.newest->stamp);
  EXPECT_LT(local(caught_up.newest->pose, state.newest->pose).norm(), 1e-12);
  EXPECT_TRUE(caught_up.covariance.isApprox(state.covariance, 1e-6));  // what was taken together gives the same
  EXPECT_EQ(behind.robot.node().agent().newest_sample(), kOdometry[299].stamp);
}

TEST(FeedFront, FillsUpUntilAllIsStored) {
  Behind behind({.inputs = 8});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(behind.front.is_filling());
    ASSERT_TRUE(behind.front.add(sample(i)));
  }
  EXPECT_TRUE(behind.front.is_filling());
  while (behind.front.take(0.0)) behind.front.note_heard();
  EXPECT_TRUE(behind.front.is_filling()) << "it may have to be handed out again";
  behind.front.note_stored();
  EXPECT_FALSE(behind.front.is_filling());
}

TEST(FeedFront, OfALongTimeTheWholeTrajectoryStaysEvenly) {
  FeedFront front(test::NodeTarget().state(), {.inputs = 100});
  for (std::size_t i = 0; i < kOdometry.size() * 20; ++i)
    ASSERT_TRUE(
        front.add(OdometrySample{Timestamp{} + 0.005 * static_cast<double>(i), {}, 1e-9 * Matrix6d::Identity()}));
  std::optional<Timestamp> before;
  double longest_s = 0.0, variance = 0.0;
  std::size_t kept = 0;
  while (const auto input = front.take(0.0)) {
    const auto& one = *sample_in<OdometrySample>(*input);
    if (before) longest_s = std::max(longest_s, one.stamp - *before);
    if (before) variance += one.increment_covariance(0, 0);
    before = one.stamp;
    ++kept;
  }
  EXPECT_GT(kept, 20U);
  EXPECT_LE(kept, 100U);
  EXPECT_LT(longest_s, 40.0 / 20.0);
  EXPECT_GT(variance, 7900 * 1e-9);  // nothing of it is forgotten
}

TEST(FeedFront, ARobotThatIsMadeAgainGetsWhatItHadNotStored) {
  Behind behind;
  for (std::size_t i = 0; i < 10; ++i) ASSERT_TRUE(behind.front.add(sample(i)));
  EXPECT_FALSE(behind.front.state().stored.has_value());
  behind.work();
  EXPECT_EQ(behind.front.state().stored, kOdometry[9].stamp);
  for (std::size_t i = 10; i < 20; ++i) ASSERT_TRUE(behind.front.add(sample(i)));
  for (std::size_t i = 0; i < 5; ++i) ASSERT_TRUE(behind.front.take(0.0));
  behind.front.note_heard();
  EXPECT_EQ(behind.front.state().stored, kOdometry[9].stamp);
  behind.front.begin_again(behind.robot.node().agent().newest_sample());
  behind.front.say_trouble("the disk is full");
  EXPECT_EQ(behind.front.state().alerts.size(), 1U);
  behind.front.say_trouble("");
  EXPECT_TRUE(behind.front.state().alerts.empty());
  EXPECT_EQ(behind.work(), 10U);
  EXPECT_EQ(behind.robot.node().agent().keyframes().size(), 20U);
  EXPECT_EQ(behind.front.state().stored, kOdometry[19].stamp);
  EXPECT_TRUE(behind.front.take_refusals().empty());
}

TEST(FeedFront, AnInputWithWhichTheRobotGoesIsLeftOutAfterThreeTimes) {
  Behind behind({.tries = 3});
  for (std::size_t i = 0; i < 10; ++i) ASSERT_TRUE(behind.front.add(sample(i)));
  for (int time = 0; time < 3; ++time) {
    EXPECT_TRUE(behind.front.take_refusals().empty());
    for (std::size_t i = 0; i <= 5; ++i) {
      EXPECT_EQ(sample_in<OdometrySample>(*behind.front.take(0.0))->stamp, kOdometry[i].stamp);
      if (i < 5) behind.front.note_heard();
    }
    behind.front.begin_again(std::nullopt);
  }
  const auto refused = behind.front.take_refusals();
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0].stamp, kOdometry[5].stamp);
  EXPECT_EQ(behind.work(), 9U);
}

TEST(FeedFront, EndsWhenEverythingIsStored) {
  Behind behind;
  for (std::size_t i = 0; i < 10; ++i) ASSERT_TRUE(behind.front.add(sample(i)));
  ASSERT_TRUE(behind.front.finish());
  EXPECT_FALSE(behind.front.state().ended);
  while (behind.front.take(0.0)) behind.front.note_heard();
  EXPECT_FALSE(behind.front.state().ended);
  behind.front.begin_again(std::nullopt);
  behind.work();
  EXPECT_TRUE(behind.front.state().ended);
  EXPECT_TRUE(behind.front.has_ended());
  ASSERT_TRUE(behind.front.add(sample(10)));
  EXPECT_FALSE(behind.front.has_ended());
  behind.front.close();
  EXPECT_FALSE(behind.front.add(sample(11)));
  EXPECT_EQ(behind.work(), 1U);
}

TEST(FeedFront, TwoThreadsMakeTheSameRobot) {
  Behind behind;
  std::jthread feeder([&] {
    for (std::size_t i = 0; i < kOdometry.size(); ++i) {
      EXPECT_TRUE(behind.front.add(sample(i)));
      EXPECT_TRUE(give_scan(behind.front, i, 3));
      EXPECT_EQ(behind.front.state().newest->stamp, kOdometry[i].stamp);
      static_cast<void>(behind.front.take_refusals());
    }
    EXPECT_TRUE(behind.front.finish());
  });
  while (!behind.front.has_ended()) {
    if (auto input = behind.front.take(0.01)) {
      EXPECT_TRUE(give(behind.robot, *input));
      behind.front.note_heard();
      behind.front.refuse({}, "for nothing");
      behind.front.publish(behind.robot.state());
    }
    behind.front.note_stored();
  }
  test::NodeTarget alone;
  for (std::size_t i = 0; i < kOdometry.size(); ++i) {
    ASSERT_TRUE(alone.add(sample(i)));
    ASSERT_TRUE(give_scan(alone, i, 3));
  }
  ASSERT_TRUE(alone.finish());
  EXPECT_EQ(behind.robot.node().agent().keyframes(), alone.node().agent().keyframes());
  EXPECT_TRUE(behind.front.state().covariance.isApprox(alone.state().covariance, 1e-9));
}

}  // namespace feed_front_test
}  // namespace tutti::program
