// SPDX-License-Identifier: BSD-3-Clause
// Images, IMU samples, position fixes and clocks, as clients of a live feed send them.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/program/feed/session_fixture.hpp"

namespace tutti::program {
namespace feed_session_sensors_test {

using Feed = v1::Feed;
using FeedSessionSensors = test::SessionFixture;

Sensors one_camera() {
  Sensors out;
  out.cameras.resize(1);
  out.cameras[0].model = {.width_px = 8, .height_px = 4, .fx = 5.0, .fy = 5.0, .cx = 3.5, .cy = 1.5};
  return out;
}
EncodedImages raw(std::int64_t ns, std::size_t bytes = 32) { return {{ns}, {{0, true, std::string(bytes, 'x')}}, {}}; }

TEST_F(FeedSessionSensors, TakesImagesAndImuAndRefusesThemByName) {
  session_.connect(1);
  Sensors sensors = one_camera();
  sensors.imu = ImuNoise{};
  const auto greeting = say(1, test::hello(test::sensors(sensors)));
  ASSERT_EQ(greeting.size(), 2U);
  EXPECT_EQ(target_.sensors, sensors);
  const auto& takes = greeting[0].welcome().takes();
  EXPECT_NE(std::ranges::find(takes, "images"), takes.end());
  EXPECT_TRUE(say(1, test::images(raw(5)) + test::imu({{.stamp = {3}}, {.stamp = {4}}})).empty());
  EXPECT_EQ(target_.seen, std::vector<Timestamp>{{5}});
  EXPECT_EQ(target_.felt, (std::vector<Timestamp>{{3}, {4}}));
  // Half an image, one of a camera that is not there, one of no encoding, depth of nobody, IMU of half a sample.
  EncodedImages second = raw(7);
  second.images[0].camera = 1;
  EncodedImages depth = raw(8);
  depth.depth = EncodedImage{0, true, std::string(64, 'x')};
  Feed strange, half;
  ASSERT_TRUE(strange.ParseFromString(test::images(raw(9)).substr(4)));
  strange.mutable_images()->mutable_image(0)->set_encoding(static_cast<Feed::Image::Encoding>(7));
  ASSERT_TRUE(half.ParseFromString(test::imu({{.stamp = {10}}}).substr(4)));
  half.mutable_imu()->add_gyro(1.0);
  const std::vector<std::pair<std::string, std::string>> all{{test::images(raw(6, 16)), "16 bytes, expected 32"},
                                                             {test::images(second), "camera 1"},
                                                             {test::images(depth), "depth"},
                                                             {test::framed(strange), "encoding"},
                                                             {test::framed(half), "numbers of the gyro"}};
  for (const auto& [bytes, expected] : all) {
    const auto answer = say(1, bytes);
    ASSERT_EQ(answer.size(), 1U) << expected;
    EXPECT_NE(answer[0].refused().why().find(expected), std::string::npos) << answer[0].refused().why();
  }
  EXPECT_EQ(target_.seen.size(), 1U);
  EXPECT_EQ(say(1, sample(20)).size(), 1U);  // the connection stays
}

TEST_F(FeedSessionSensors, WhatTheBodyReportsReachesTheRobotOrIsRefusedByName) {
  join(1);
  Feed good, bad;
  good.mutable_health()->set_battery_v(24.5);
  EXPECT_TRUE(say(1, test::framed(good)).empty());
  EXPECT_EQ(target_.health, (Health{.battery_v = 24.5}));
  bad.mutable_health()->set_battery_percent(101.0);
  const auto answer = say(1, test::framed(bad));
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].refused().why(), "health: battery_percent: 101, expected 0 to 100");
  EXPECT_EQ(target_.health, (Health{.battery_v = 24.5}));
}

TEST_F(FeedSessionSensors, AStartPoseReachesTheRobotOrIsRefusedByName) {
  join(1);
  Feed good, nowhere, bad, none;
  auto& start = *good.mutable_start_pose();
  start.mutable_t_world_body()->set_x(3.0);
  start.mutable_t_world_body()->set_qw(1.0);
  for (int i = 0; i < 6; ++i) start.add_covariance(0.25);
  start.set_is_planar(true);
  nowhere.mutable_start_pose();
  EXPECT_TRUE(say(1, test::framed(good)).empty());
  EXPECT_TRUE(say(1, test::framed(nowhere)).empty());
  ASSERT_EQ(target_.starts.size(), 2U);
  EXPECT_EQ(target_.starts[0].T_world_body->T_a_b.translation.x(), 3.0);
  EXPECT_EQ(target_.starts[0].T_world_body->covariance(5, 5), 0.25);
  EXPECT_TRUE(target_.starts[0].is_planar);
  EXPECT_FALSE(target_.starts[1].T_world_body.has_value());
  bad = good;
  bad.mutable_start_pose()->mutable_t_world_body()->set_qw(0.0);
  none.mutable_start_pose()->mutable_t_world_body()->set_qw(1.0);
  for (const auto& [message, why] :
       {std::pair{bad, "a start pose whose quaternion has norm 0, expected 1"},
        std::pair{none, "a start pose with a covariance of 0 numbers, expected 36, or 6 of its diagonal"}}) {
    const auto answer = say(1, test::framed(message));
    ASSERT_EQ(answer.size(), 1U);
    EXPECT_EQ(answer[0].refused().why(), why);
  }
  EXPECT_EQ(target_.starts.size(), 2U);
}

TEST_F(FeedSessionSensors, WhatTheRobotReportsIsSentWhenItChanges) {
  join(1);
  target_.known.status = std::make_shared<const decltype(FeedState::status)::element_type>(
      decltype(FeedState::status)::element_type{{"keyframes", "7"}, {"battery_percent", "50"}});
  session_.refresh();
  const auto heard = read(1);
  ASSERT_EQ(heard.size(), 1U);
  ASSERT_EQ(heard[0].situation().status_size(), 2);
  EXPECT_EQ(heard[0].situation().status(1).name(), "battery_percent");
  EXPECT_EQ(heard[0].situation().status(1).text(), "50");
  session_.refresh();
  EXPECT_TRUE(read(1).empty());
}

TEST_F(FeedSessionSensors, ImagesOfWhomNobodySetUpACamera) {
  join(1);
  const auto answer = say(1, test::images(raw(5)));
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_NE(answer[0].refused().why().find("no camera is set up"), std::string::npos);
  EXPECT_EQ(answer[0].refused().stamp_ns(), 5);
}

TEST_F(FeedSessionSensors, SensorsThatCannotBeAreReportedAndEndTheConnection) {
  const auto refused = [&](const auto& spoil, const std::string& expected) {
    v1::Feed::Sensors sensors = test::sensors(one_camera());
    spoil(sensors);
    session_.connect(1);
    const auto answer = say(1, test::hello(sensors));
    ASSERT_EQ(answer.size(), 1U) << expected;
    EXPECT_NE(answer[0].closed().why().find(expected), std::string::npos) << answer[0].closed().why();
    session_.disconnect(1);
  };
  refused([](auto& s) { s.mutable_camera(0)->set_kind(static_cast<Feed::Camera::Kind>(9)); }, "kind (9)");
  refused([](auto& s) { s.mutable_camera(0)->set_width_px(0xffffffff); }, "pixels");
  refused([](auto& s) { s.mutable_camera(0)->set_fx(-1.0); }, "camera 0");
  refused([](auto& s) { s.mutable_camera(0)->add_distortion(0.0); }, "9 numbers of distortion");
  refused([](auto& s) { s.mutable_camera(0)->clear_t_body_camera(); }, "T_body_camera");
  refused([](auto& s) { s.mutable_camera(0)->mutable_t_body_camera()->set_qw(3.0); }, "no pose");
  refused([](auto& s) { *s.add_camera() = *s.add_camera() = s.camera(0); }, "3 cameras");
  refused([](auto& s) { s.mutable_depth()->set_unit_m(1.0); }, "depth");
  refused([](auto& s) { s.mutable_imu()->set_gyro_random_walk(-1.0); }, "imu");
  EXPECT_FALSE(session_.has_feeder());
  join(2);
}

TEST_F(FeedSessionSensors, FixesComeAsTheyWereSent) {
  join(1);
  PositionFix fix{.stamp = {5}, .antenna = {46.5, -7.9, 612.5}, .p_body_antenna = {0.3, 0.1, 1.2}};
  fix.covariance << 2.0, 0.5, 0.1, 0.5, 3.0, 0.2, 0.1, 0.2, 9.0;
  EXPECT_TRUE(say(1, test::fix(fix)).empty());  // as of scans nothing is answered
  Feed brief;                                   // a receiver that sends no more than where it is
  brief.mutable_fix()->set_stamp_ns(6);
  brief.mutable_fix()->set_latitude_deg(46.5);
  EXPECT_TRUE(say(1, test::framed(brief)).empty());
  for (const double variance : {1.0, 4.0, 9.0}) brief.mutable_fix()->add_covariance_m2(variance);
  EXPECT_TRUE(say(1, test::framed(brief)).empty());
  ASSERT_EQ(target_.fixes.size(), 3U);
  EXPECT_EQ(target_.fixes[0].stamp, fix.stamp);
  EXPECT_EQ(target_.fixes[0].antenna, fix.antenna);
  EXPECT_EQ(target_.fixes[0].covariance, fix.covariance);
  EXPECT_EQ(target_.fixes[0].p_body_antenna, fix.p_body_antenna);
  EXPECT_EQ(target_.fixes[1].covariance, unknown_fix_covariance());
  EXPECT_EQ(target_.fixes[1].p_body_antenna, Eigen::Vector3d::Zero());
  EXPECT_EQ(target_.fixes[2].covariance, Eigen::Matrix3d(Eigen::Vector3d(1, 4, 9).asDiagonal()));
  for (int spoilt = 0; spoilt < 2; ++spoilt) {
    Feed bad = brief;
    if (spoilt == 0) bad.mutable_fix()->add_covariance_m2(1.0);
    if (spoilt == 1) bad.mutable_fix()->add_p_body_antenna(1.0);
    const auto answer = say(1, test::framed(bad));
    ASSERT_EQ(answer.size(), 1U);
    EXPECT_NE(answer[0].refused().why().find(spoilt == 0 ? "covariance_m2 of 4" : "p_body_antenna of 1"),
              std::string::npos)
        << answer[0].refused().why();
  }
  EXPECT_EQ(target_.fixes.size(), 3U);
  EXPECT_EQ(say(1, sample(20)).size(), 1U);  // the connection stays
}

TEST_F(FeedSessionSensors, AMessageOfANewerProtocolIsRefusedByItsNumber) {
  join(1);
  const std::string newer("\x0a\x00\x00\x00\x6a\x08\x12\x06 later", 14);  // field 13
  const auto answer = say(1, newer);
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_NE(answer[0].refused().why().find("number 13"), std::string::npos) << answer[0].refused().why();
  EXPECT_NE(answer[0].refused().why().find("images"), std::string::npos);
  EXPECT_EQ(say(1, sample(20)).size(), 1U);
}

TEST_F(FeedSessionSensors, WhoDiesInTheMiddleOfAnImageLeavesNothingBehind) {
  session_.connect(1);
  ASSERT_EQ(say(1, test::hello(test::sensors(one_camera()))).size(), 2U);
  EXPECT_EQ(say(1, sample(1)).size(), 1U);
  const std::string image = test::images(raw(5));
  EXPECT_TRUE(say(1, image.substr(0, image.size() / 2)).empty());
  session_.disconnect(1);
  EXPECT_TRUE(target_.seen.empty());
  session_.connect(2);
  ASSERT_EQ(say(2, test::hello(test::sensors(one_camera()))).size(), 2U);
  EXPECT_TRUE(say(2, image).empty());
  EXPECT_EQ(target_.seen, std::vector<Timestamp>{{5}});
}

TEST_F(FeedSessionSensors, AClockThatIsNotTheRobots) {
  constexpr std::int64_t kOff = 3 * 3600 * 1'000'000'000LL;
  Feed hello;
  hello.mutable_hello()->set_protocol_version(kFeedVersion);
  hello.mutable_hello()->set_clock_now_ns(now_.ns - kOff);
  session_.connect(1);
  const auto greeting = say(1, test::framed(hello));
  ASSERT_EQ(greeting.size(), 2U);
  EXPECT_EQ(greeting[0].welcome().clock_offset_ns(), kOff);
  join(2, true);
  const std::int64_t stamp = now_.ns - kOff + 7;
  const auto answer = say(1, sample(stamp));
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].correction().stamp_ns(), stamp);  // by its own clock
  EXPECT_EQ(target_.known.newest->stamp.ns, now_.ns + 7);
  EXPECT_TRUE(say(1, test::fix({.stamp = {stamp}, .antenna = {46.5, 7.9, 0.0}})).empty());
  EXPECT_EQ(target_.fixes.at(0).stamp.ns, now_.ns + 7);
  const auto other = read(2);
  ASSERT_EQ(other.size(), 1U);
  EXPECT_EQ(other[0].correction().stamp_ns(), now_.ns + 7);  // by the robot's
  const auto backwards = say(1, sample(stamp - 1));
  EXPECT_EQ(backwards[0].refused().stamp_ns(), stamp - 1);
  const auto never = say(1, sample(std::numeric_limits<std::int64_t>::max()));
  EXPECT_NE(never[0].refused().why().find("no such time"), std::string::npos);

  now_ = now_ + 100.0;
  Feed time;
  time.mutable_time()->set_clock_now_ns(now_.ns - kOff + 20'000'000);  // 20 ms faster by now
  const auto heard = say(1, test::framed(time));
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(heard[0].time_answer().robot_now_ns(), now_.ns);
  EXPECT_EQ(heard[0].time_answer().clock_offset_ns(), kOff);
  EXPECT_EQ(heard[0].time_answer().measured_offset_ns(), kOff - 20'000'000);
  EXPECT_NEAR(*session_.feeder().clock.drift_ppm(), 200.0, 1e-6);
  session_.disconnect(1);
  session_.connect(1);
  hello.mutable_hello()->set_clock_now_ns(now_.ns - kOff + 20'000'000);
  const auto again = say(1, test::framed(hello));
  EXPECT_EQ(again[0].welcome().clock_offset_ns(), kOff);
  EXPECT_EQ(again[0].welcome().last_stamp_ns(), stamp);
}

}  // namespace feed_session_sensors_test
}  // namespace tutti::program
