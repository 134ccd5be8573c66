// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/program/feed/feed_front.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {
namespace feed_front_fixes_test {

const Trajectory kOdometry = robot::test::drifting_odometry(200);

OdometrySample sample(std::size_t i) { return {kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}; }
PositionFix fix(Timestamp stamp) {
  return {.stamp = stamp, .antenna = {46.5, 7.9, 600.0}, .p_body_antenna = {0.3, 0.0, 1.2}};
}
std::string why(const Status& status) { return status ? "" : status.error().message; }

/// Hands the front's inputs to the robot and returns its refusals.
std::vector<std::string> work(FeedFront& front, test::NodeTarget& robot) {
  std::vector<std::string> out;
  while (const auto input = front.take(0.0)) {
    const auto* of_robot = std::get_if<Input>(&*input);
    const Status taken = of_robot != nullptr ? robot.add(*of_robot) : robot.finish();
    if (!taken) out.push_back(taken.error().message);
    front.note_heard();
  }
  front.note_stored();
  front.publish(robot.state());
  return out;
}

std::vector<Submap> submaps(test::NodeTarget& robot) {
  std::vector<Submap> out;
  for (const bus::Envelope& sent : robot.take_sent())
    if (sent.kind == bus::MessageKind::submap) out.push_back(wire::decode_submap(*sent.bytes).value().submap);
  return out;
}

TEST(FeedFrontFixes, GarbageIsRefusedAtOnceAndOdometryGoesOn) {
  test::NodeTarget robot;
  FeedFront front(robot.state(), {});
  const auto expect = [&](const PositionFix& of, const std::string& part) {
    const std::string refusal = why(front.add(of));
    EXPECT_NE(refusal.find(part), std::string::npos) << part << ": " << refusal;
  };
  expect(fix(kOdometry[0].stamp), "no odometry within 1 s before");
  ASSERT_TRUE(front.add(sample(0)));
  const Timestamp now = kOdometry[0].stamp;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto spoilt = [&](auto&& spoil) {
    PositionFix out = fix(now);
    spoil(out);
    return out;
  };
  expect(spoilt([&](PositionFix& f) { f.antenna.latitude_deg = nan; }), "latitude nan degrees");
  expect(spoilt([&](PositionFix& f) { f.antenna.latitude_deg = 90.5; }), "latitude 90.5 degrees, expected -90 to 90");
  expect(spoilt([&](PositionFix& f) { f.antenna.height_m = nan; }), "height nan m");
  expect(spoilt([&](PositionFix& f) { f.covariance(0, 0) = -1.0; }), "variance -1 m^2 east");
  expect(spoilt([&](PositionFix& f) { f.covariance.setZero(); }), "variance 0 m^2 east");
  expect(spoilt([&](PositionFix& f) { f.covariance(0, 1) = f.covariance(1, 0) = 1e3; }), "positive semidefinite");
  expect(spoilt([&](PositionFix& f) { f.covariance(0, 1) = nan; }), "positive semidefinite");
  expect(spoilt([&](PositionFix& f) { f.p_body_antenna.y() = nan; }), "antenna nan m from the body");
  EXPECT_EQ(why(front.add(fix(now))), "");
  expect(fix(now), "there was one at 1700000000000000000 ns, stamps must increase");
  expect(fix(now + -0.1), "stamps must increase");
  expect(fix(now + 3600.0), "no odometry within 1 s before");
  for (std::size_t i = 1; i < 100; ++i) ASSERT_TRUE(front.add(sample(i)));
  EXPECT_TRUE(work(front, robot).empty());
  EXPECT_EQ(front.figures().fixes, 1U);
  EXPECT_EQ(front.figures().fixes_left_out, 12U);
  EXPECT_EQ(robot.state().newest->stamp, kOdometry[99].stamp);
}

/// Only the robot knows which odometry it still has.
TEST(FeedFrontFixes, WhatComesTooLateIsRefusedLater) {
  test::NodeTarget robot;
  FeedFront front(robot.state(), {});
  for (std::size_t i = 0; i < 20; ++i) ASSERT_TRUE(front.add(sample(i)));
  EXPECT_EQ(why(front.add(fix(kOdometry[5].stamp))), "");
  EXPECT_EQ(why(front.add(fix(kOdometry[19].stamp + -0.7))), "");  // as receivers are
  const auto refused = work(front, robot);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_NE(refused[0].find("too late, or its clock is another one"), std::string::npos) << refused[0];
}

/// Two a second are used, and the robot that is behind them hears all odometry.
TEST(FeedFrontFixes, AHundredASecondAreThinnedAndHarmNothing) {
  constexpr std::size_t kSamples = 100;
  std::vector<Submap> fast, slow;
  for (const int hz : {100, 2}) {
    test::NodeTarget robot;
    FeedFront front(robot.state(), {});
    for (std::size_t i = 0; i < kSamples; ++i) {
      ASSERT_TRUE(front.add(sample(i)));
      for (int k = 0; k < hz / 2; ++k) ASSERT_EQ(why(front.add(fix(kOdometry[i].stamp + k / double(hz)))), "");
      if (i % 10 == 9) {
        EXPECT_TRUE(work(front, robot).empty());
      }
    }
    ASSERT_TRUE(front.finish());
    EXPECT_TRUE(work(front, robot).empty());
    (hz == 2 ? slow : fast) = submaps(robot);
  }
  ASSERT_EQ(fast.size(), slow.size());
  ASSERT_GE(fast.size(), 4U);
  std::size_t fixes = 0;
  for (std::size_t i = 0; i < fast.size(); ++i) {
    EXPECT_EQ(fast[i].keyframes, slow[i].keyframes);
    EXPECT_EQ(fast[i].odometry, slow[i].odometry);
    EXPECT_LE(fast[i].fixes.size(), 1.25 * static_cast<double>(slow[i].fixes.size()));
    fixes += fast[i].fixes.size();
  }
  EXPECT_GE(fixes, kSamples / 2);
}

TEST(FeedFrontFixes, OfARobotThatIsBehindTheyAreLeftOutBeforeOdometryIs) {
  test::NodeTarget robot;
  FeedFront front(robot.state(), {.inputs = 40});
  std::size_t refused = 0;
  for (std::size_t i = 0; i < kOdometry.size(); ++i) {
    ASSERT_TRUE(front.add(sample(i)));
    for (int k = 0; k < 5; ++k) {
      const std::string refusal = why(front.add(fix(kOdometry[i].stamp + 0.1 * k)));
      if (refusal.empty()) continue;
      EXPECT_EQ(refusal.find("the map is behind: "), 0U) << refusal;
      ++refused;
    }
    ASSERT_LE(front.load().waiting, 40U);
  }
  EXPECT_GT(refused, 900U);
  EXPECT_TRUE(work(front, robot).empty());
  EXPECT_EQ(robot.state().newest->stamp, kOdometry.back().stamp);
  EXPECT_LT((robot.state().newest->pose.translation - kOdometry.back().pose.translation).norm(), 1e-9);
}

}  // namespace feed_front_fixes_test
}  // namespace tutti::program
