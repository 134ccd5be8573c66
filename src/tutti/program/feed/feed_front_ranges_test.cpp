// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/program/feed/client_messages.hpp"
#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/feed_front.hpp"
#include "tutti/program/feed/robot_view.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {
namespace feed_front_ranges_test {

const Trajectory kOdometry = robot::test::drifting_odometry(200);

OdometrySample sample(std::size_t i) { return {kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}; }
RobotRange range(Timestamp stamp, const std::string& name = "bravo") {
  return {
      .stamp = stamp, .to = {}, .distance_m = 12.5, .sigma_m = 0.1, .p_body_antenna = {0.3, 0.0, 1.2}, .name = name};
}
std::string why(const Status& status) { return status ? "" : status.error().message; }

TEST(FeedFrontRanges, ComeThroughTheSocketAsTheyWereSent) {
  for (const RobotRange& sent : {range({5}), range({-7}, ""), RobotRange{}}) {
    const auto message = decode_from_client(test::message_of(sent).SerializeAsString());
    ASSERT_TRUE(message) << message.error().message;
    const auto* heard = sample_in<RobotRange>(*message);
    ASSERT_NE(heard, nullptr);
    EXPECT_EQ(*heard, sent);
  }
}

TEST(FeedFrontRanges, GarbageIsRefusedAtOnceAndOdometryGoesOn) {
  test::NodeTarget robot;
  FeedFront front(robot.state(), {});
  const auto expect = [&](const RobotRange& of, const std::string& part) {
    const std::string refusal = why(front.add(of));
    EXPECT_NE(refusal.find(part), std::string::npos) << part << ": " << refusal;
  };
  expect(range(kOdometry[0].stamp), "no odometry within 1 s before");
  ASSERT_TRUE(front.add(sample(0)));
  const Timestamp now = kOdometry[0].stamp;
  RobotRange bad = range(now);
  bad.distance_m = std::numeric_limits<double>::quiet_NaN();
  expect(bad, "distance nan m, expected 0 to 100000 m");
  bad.distance_m = -0.5;
  expect(bad, "distance -0.5 m, expected 0 to 100000 m");
  bad = range(now);
  bad.sigma_m = -1.0;
  expect(bad, "sigma -1 m");
  expect(range(now, "two words"), "to 'two words', expected a robot's name");
  EXPECT_EQ(why(front.add(range(now))), "");
  EXPECT_EQ(why(front.add(range(now, "charlie"))), "") << "ranges to two robots at once";
  expect(range(now + -0.1), "stamps must increase");
  expect(range(now + 3600.0), "no odometry within 1 s before");
  ASSERT_TRUE(front.add(sample(1)));
}

/// As in a mission's list; of a robot in none the number that is made of its name.
TEST(FeedFrontRanges, NamesBecomeTheNumbersOfTheirRobots) {
  const RobotView view("alpha", {{RobotId{0}, "alpha"}, {RobotId{1}, "bravo"}});
  EXPECT_EQ(view.number_of("bravo"), RobotId{1});
  EXPECT_EQ(view.number_of("charlie"), robot_id_of("charlie"));
  EXPECT_GE(robot_id_of("charlie").value, 0x8000'0000U);
}

}  // namespace feed_front_ranges_test
}  // namespace tutti::program
