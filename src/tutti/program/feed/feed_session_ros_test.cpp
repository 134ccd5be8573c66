// SPDX-License-Identifier: BSD-3-Clause
// Raw messages of ROS, as a client of a live feed hands them on.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/intake/messages.hpp"
#include "support/program/feed/session_fixture.hpp"

namespace tutti::program {
namespace feed_session_ros_test {

using namespace intake::test;
using Feed = v1::Feed;
using Kind = v1::Feed::WhatCase;

std::string hello(const Feed::Ros& ros, std::optional<std::int64_t> offset_ns = {}) {
  Feed message;
  message.mutable_hello()->set_protocol_version(kFeedVersion);
  message.mutable_hello()->mutable_sensors()->set_scans(true);
  *message.mutable_hello()->mutable_ros() = ros;
  if (offset_ns) message.mutable_hello()->set_clock_offset_ns(*offset_ns);
  return test::framed(message);
}
std::string raw(const std::string& topic, const std::string& type, const std::string& bytes) {
  return raw_frame({topic, type, "cdr", bytes});
}
std::string odometry_at(int i) {
  return raw("odom", "nav_msgs/msg/Odometry", odometry(kStart + i * kPeriod, 0.1 * i, "r1/odom"));
}
std::string still(const std::string& frame) {
  return raw("/tf_static", "tf2_msgs/msg/TFMessage", transform(0, "base_link", frame, {}));
}

class FeedSessionRos : public test::SessionFixture {
 protected:
  std::vector<Feed> begin(const Feed::Ros& ros = {}, std::optional<std::int64_t> offset_ns = {}) {
    session_.connect(1);
    return say(1, hello(ros, offset_ns));
  }
  static std::vector<Kind> kinds(const std::vector<Feed>& messages) {
    std::vector<Kind> out;
    for (const Feed& message : messages) out.push_back(message.what_case());
    return out;
  }
};

TEST_F(FeedSessionRos, OdometryIsAnsweredAsEverAndAsMessagesToPublish) {
  const auto greeting = begin();
  ASSERT_EQ(kinds(greeting), (std::vector{Feed::kWelcome, Feed::kSituation}));
  const auto& takes = greeting[0].welcome().takes();
  EXPECT_NE(std::ranges::find(takes, "raw"), takes.end());
  const auto answer = say(1, odometry_at(0));
  ASSERT_EQ(kinds(answer), (std::vector{Feed::kCorrection, Feed::kRaw, Feed::kRaw, Feed::kNote}));
  EXPECT_EQ(answer[0].correction().stamp_ns(), kStart);
  EXPECT_EQ(answer[1].raw().topic(), "/tf");
  const auto tf = bags::decode_tf(answer[1].raw().data()).value();
  EXPECT_EQ(tf[0].header.frame_id, "r1/map");
  EXPECT_EQ(tf[0].child_frame_id, "r1/odom");
  EXPECT_EQ(tf[0].header.stamp.ns, kStart);
  EXPECT_EQ(answer[2].raw().topic(), "corrected_pose");
  EXPECT_EQ(target_.known.newest->stamp.ns, kStart);
  const auto path = say(1, raw("corrected_path", "nav_msgs/msg/Path", ""));
  ASSERT_EQ(kinds(path), std::vector{Feed::kRaw});
  EXPECT_EQ(path[0].raw().type(), "nav_msgs/msg/Path");
  EXPECT_FALSE(path[0].raw().data().empty());
}

/// As amcl or a SLAM node beside it does. Its own transforms come back from the same topic.
TEST_F(FeedSessionRos, WhoeverElsePublishesWhereOdometryIsIsNamedOnce) {
  begin();
  std::vector<std::string> refused;
  const auto hear = [&](const std::string& message) {
    std::string own;
    for (const Feed& answer : say(1, message)) {
      if (answer.what_case() == Feed::kRefused) refused.push_back(answer.refused().why());
      if (answer.what_case() == Feed::kRaw && answer.raw().topic() == "/tf") own = answer.raw().data();
    }
    return own;
  };
  const auto tf = [](const std::string& bytes) { return raw("/tf", "tf2_msgs/msg/TFMessage", bytes); };
  for (int i = 0; i < 30; ++i) {
    const std::string own = hear(odometry_at(i));
    ASSERT_FALSE(own.empty());
    hear(tf(own));
    auto again = bags::decode_tf(own).value();  // as tutti_ros publishes it while the robot is silent
    again.front().header.stamp.ns += 3;
    hear(tf(bags::encode(again)));
    hear(tf(transform(kStart + i * kPeriod, "r1/odom", "r1/base_link", {})));
    hear(tf(transform(kStart + i * kPeriod, "map", "r2/odom", {})));
  }
  EXPECT_TRUE(refused.empty()) << refused.front();
  for (int i = 30; i < 60; ++i) {
    hear(tf(transform(kStart + i * kPeriod, "r1/map", "r1/odom", {Eigen::Quaterniond::Identity(), {2, 0, 0}})));
    hear(odometry_at(i));
  }
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0].find("/tf: somebody else publishes r1/map -> r1/odom, as this robot does r1/map -> r1/odom"), 0U)
      << refused[0];
}

TEST_F(FeedSessionRos, AFixedFrameOfOdometryBesideTheRobotsIsNamedToo) {
  begin();
  say(1, odometry_at(0));
  const auto answers = say(1, raw("/tf_static", "tf2_msgs/msg/TFMessage", transform(0, "map", "r1/odom", {})));
  ASSERT_EQ(kinds(answers), std::vector{Feed::kRefused});
  EXPECT_EQ(answers[0].refused().why().find("/tf_static: somebody else publishes map -> r1/odom"), 0U);
}

TEST_F(FeedSessionRos, TheClientStatesFramesAndToleranceAndIsAnsweredByItsOwnClock) {
  constexpr std::int64_t kOffset = 5 * kSecond;
  Feed::Ros ros;
  ros.set_map_frame("world");
  ros.set_odom_frame("o");
  ros.set_tolerance_s(0.5);
  begin(ros, kOffset);
  const auto answer = say(1, odometry_at(0));
  EXPECT_EQ(target_.known.newest->stamp.ns, kStart + kOffset);
  EXPECT_EQ(answer.at(0).correction().stamp_ns(), kStart);
  const auto tf = bags::decode_tf(answer.at(1).raw().data()).value();
  EXPECT_EQ(tf[0].header.frame_id, "world");
  EXPECT_EQ(tf[0].child_frame_id, "o");
  EXPECT_EQ(tf[0].header.stamp.ns, kStart + kSecond / 2);
}

/// As RViz sends it: x, y and heading in the frame that it shows.
TEST_F(FeedSessionRos, AStartPoseIsTakenInTheFrameOfTheKnownMap) {
  Feed::Ros ros;
  ros.set_world_frame("world");
  begin(ros);
  say(1, odometry_at(0));
  const auto start = [](const std::string& frame) {
    bags::RosPoseWithCovariance out{.header = {{}, frame}, .pose = {{4, 5, 0}}};
    out.covariance[0] = out.covariance[7] = 0.25;
    out.covariance[35] = 0.07;
    return raw("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", bags::encode(out));
  };
  EXPECT_TRUE(say(1, start("world")).empty());
  ASSERT_EQ(target_.starts.size(), 1U);
  EXPECT_TRUE(target_.starts[0].is_planar);
  EXPECT_EQ(target_.starts[0].T_world_body->T_a_b.translation, Eigen::Vector3d(4, 5, 0));
  EXPECT_EQ(target_.starts[0].T_world_body->covariance(5, 5), 0.07);
  EXPECT_EQ(target_.starts[0].floor, 1U);
  EXPECT_TRUE(say(1, start("world_2")).empty());
  ASSERT_EQ(target_.starts.size(), 2U);
  EXPECT_EQ(target_.starts[1].floor, 2U);

  const auto refused = say(1, start("r1/map"));
  ASSERT_EQ(kinds(refused), std::vector{Feed::kRefused});
  EXPECT_EQ(refused[0].refused().why(),
            "initialpose: a start pose in frame 'r1/map', expected 'world', the frame of the map that the robot "
            "localises in, or 'r1/map' once it has found itself there");
  target_.known.component = 2;
  target_.known.T_map_world = Pose3{Eigen::Quaterniond::Identity(), {1, 0, 0}};
  target_.known.T_world_body = RelativePose{{Eigen::Quaterniond::Identity(), {2, 0, 0}}, Matrix6d::Identity()};
  target_.known.located = {kStart};
  session_.refresh();
  const auto told = say(1, "");
  const auto pose = std::ranges::find(told, "localised_pose", [](const Feed& m) { return m.raw().topic(); });
  ASSERT_NE(pose, told.end());
  const auto localised = bags::decode_pose_with_covariance(pose->raw().data()).value();
  EXPECT_EQ(localised.header.frame_id, "world_3");
  EXPECT_EQ(localised.header.stamp.ns, kStart);
  EXPECT_EQ(localised.pose.position.x(), 2.0);
  EXPECT_TRUE(say(1, start("r1/map")).empty());
  ASSERT_EQ(target_.starts.size(), 3U);
  EXPECT_EQ(target_.starts[2].T_world_body->T_a_b.translation, Eigen::Vector3d(3, 5, 0));
  EXPECT_EQ(target_.starts[2].floor, 3U);
}

TEST_F(FeedSessionRos, EverySensorReachesTheRobot) {
  Feed::Ros ros;
  ros.add_images("left/image_raw");
  ros.set_imu("imu");
  begin(ros);
  EXPECT_TRUE(target_.sensors.scans);
  say(1, still("camera") + still("imu") + still("lidar"));
  target_.known.wants_scan = true;
  const auto missing = say(1, odometry_at(0));
  ASSERT_EQ(kinds(missing), (std::vector{Feed::kCorrection, Feed::kRaw, Feed::kRaw, Feed::kSituation, Feed::kNote}));
  EXPECT_EQ(missing[3].situation().alert(0).text(),
            "no images are used: left/camera_info: no sensor_msgs/CameraInfo; no IMU is used: imu: no sample");
  say(1, raw("left/camera_info", "sensor_msgs/msg/CameraInfo", bags::encode(calibration())) +
             raw("left/image_raw", "sensor_msgs/msg/Image", bags::encode(grey_image(kStart + kPeriod))) +
             raw("imu", "sensor_msgs/msg/Imu", imu(kStart)) + raw("fix", "sensor_msgs/msg/NavSatFix", fix(kStart)) +
             raw("points", "sensor_msgs/msg/PointCloud2", points(kStart + kPeriod, kAtOnce, "lidar")) +
             raw("battery_state", "sensor_msgs/msg/BatteryState", bags::test::battery_state(24.5F, 0.5F)));
  const auto answers = say(1, odometry_at(1) + odometry_at(7));
  EXPECT_EQ(target_.sensors.cameras.size(), 1U);
  EXPECT_TRUE(target_.sensors.imu && target_.sensors.scans);
  EXPECT_EQ(target_.seen, std::vector<Timestamp>{{kStart + kPeriod}});
  EXPECT_EQ(target_.felt, std::vector<Timestamp>{{kStart}});
  EXPECT_EQ(target_.scans, std::vector<Timestamp>{{kStart + kPeriod}});
  EXPECT_EQ(target_.fixes.size(), 1U);
  EXPECT_EQ(target_.health, (Health{.battery_v = 24.5F, .battery_percent = 50.0}));
  session_.refresh();
  for (const Feed& one : answers) EXPECT_NE(one.what_case(), Feed::kRefused) << one.refused().why();

  // Greeted anew, the same client's cameras are known already; another's are not.
  session_.disconnect(1);
  begin(ros);
  EXPECT_EQ(target_.sensors.cameras.size(), 1U);
  session_.disconnect(1);
  begin();
  EXPECT_TRUE(target_.sensors.cameras.empty());
}

TEST_F(FeedSessionRos, WhatIsNotTakenIsReportedAndTheConnectionStays) {
  begin();
  for (const auto& [bytes, expected] :
       {std::pair(raw("odom", "nav_msgs/msg/Odometry", "abc"), "odom: "),
        std::pair(raw("chatter", "std_msgs/msg/String", ""), "chatter: messages of type 'std_msgs/msg/String'"),
        std::pair(raw_frame({"odom", "nav_msgs/msg/Odometry", "json", ""}), "odom: ")}) {
    const auto answer = say(1, bytes);
    ASSERT_EQ(kinds(answer), std::vector{Feed::kRefused});
    EXPECT_EQ(answer[0].refused().why().substr(0, std::string(expected).size()), expected);
  }
  EXPECT_EQ(say(1, odometry_at(0)).size(), 4U);
  EXPECT_FALSE(session_.is_over(1));
  session_.disconnect(1);
  join(2);  // which sent nothing of ROS
  const auto answer = say(2, odometry_at(1));
  ASSERT_EQ(kinds(answer), std::vector{Feed::kRefused});
  EXPECT_NE(answer[0].refused().why().find("Hello.ros"), std::string::npos);
}

TEST_F(FeedSessionRos, WhatCannotBeConfiguredOfRosEndsTheConnection) {
  const auto refused = [&](const auto& spoil, const std::string& expected) {
    Feed::Ros ros;
    spoil(ros);
    const auto answer = begin(ros);
    ASSERT_EQ(answer.size(), 1U) << expected;
    EXPECT_NE(answer[0].closed().why().find(expected), std::string::npos) << answer[0].closed().why();
    session_.disconnect(1);
  };
  refused([](auto& ros) { ros.set_depth("d"); }, "depth is of 'd'");
  refused([](auto& ros) { ros.mutable_t_body_lidar()->set_qw(3.0); }, "norm 3");
  refused([](auto& ros) { ros.add_p_body_antenna(1.0); }, "p_body_antenna of 1 numbers");
  refused([](auto& ros) { ros.add_noise(1.0); }, "noise of 1 numbers");
  refused(
      [](auto& ros) {
        for (int i = 0; i < 6; ++i) ros.add_noise(0.0);
      },
      "expected more than 0");
  refused([](auto& ros) { ros.set_tolerance_s(1e300); }, "tolerance_s");
  EXPECT_FALSE(session_.has_feeder());
}

TEST_F(FeedSessionRos, TheEndWaitsForNothingAndTeamMatesAreSent) {
  begin();
  say(1, odometry_at(0));
  target_.known.team_mates = {{RobotId{2}, "bravo", {7}, Pose3{}}};
  session_.refresh();
  const auto news = read(1);
  ASSERT_EQ(news.size(), 3U);
  EXPECT_EQ(news[0].raw().topic(), "team_mates");
  EXPECT_EQ(news[1].raw().topic(), "team_mates/bravo/pose");
  EXPECT_EQ(kinds(say(1, test::end_of_recording())), std::vector{Feed::kEnded});
}

/// A client that asks for the whole trajectory may be sent more than its queue holds, as nothing else waits.
TEST_F(FeedSessionRos, ALongPathEndsNoConnection) {
  begin();
  for (int i = 0; i < 200; ++i) say(1, odometry_at(i));
  const auto path = say(1, raw("corrected_path", "nav_msgs/msg/Path", ""));
  ASSERT_EQ(kinds(path), std::vector{Feed::kRaw});
  EXPECT_GT(path[0].raw().data().size(), 1024U * static_cast<std::size_t>(settings_.max_queue_kb));
}

}  // namespace feed_session_ros_test
}  // namespace tutti::program
