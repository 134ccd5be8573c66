// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/ros_answers.hpp"

#include <gtest/gtest.h>

#include "tutti/bags/ros_messages.hpp"

namespace tutti::program {
namespace ros_answers_test {

const Pose3 kMapOdom{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())), {1, 2, 3}};

FeedAnswer answer(std::int64_t ns, const Pose3& T_odom_body, const Pose3& T_map_odom = kMapOdom) {
  FeedAnswer out{.stamp = {ns}, .T_map_body = T_map_odom * T_odom_body, .T_map_odom = T_map_odom};
  return out;
}

TEST(RosAnswers, MapToOdomIsSentOnceForEachStamp) {
  RosAnswers answers("r1/odom", "", 0.1);
  EXPECT_EQ(answers.map_frame(), "r1/map");
  EXPECT_FALSE(answers.transform());
  answers.hear(answer(1'000'000'000, {}), {});
  const auto sent = bags::decode_tf(answers.transform().value()).value();
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].header.frame_id, "r1/map");
  EXPECT_EQ(sent[0].child_frame_id, "r1/odom");
  EXPECT_EQ(sent[0].header.stamp.ns, 1'100'000'000);
  EXPECT_EQ(sent[0].translation, kMapOdom.translation);
  EXPECT_FALSE(answers.transform());
  answers.hear(answer(999'999'999, {}), {});
  EXPECT_FALSE(answers.transform());
}

/// Two maps become one after a robot has stopped, so that no odometry comes any more.
TEST(RosAnswers, AWorldThatMovesIsSentWithoutOdometryToo) {
  RosAnswers answers("odom", "", 0.1);
  answers.hear_world("world_1", Pose3{});
  EXPECT_FALSE(answers.moved_world()) << "nothing was published yet";
  answers.hear(answer(1'000'000'000, {}), {});
  ASSERT_EQ(bags::decode_tf(answers.transform().value()).value().size(), 2U);
  EXPECT_FALSE(answers.moved_world());
  for (std::int64_t k = 1; k <= 2; ++k) {
    const Pose3 T_world_map{Eigen::Quaterniond::Identity(), {1.0 * static_cast<double>(k), 0, 0}};
    answers.hear_world("world", T_world_map);
    const auto moved = bags::decode_tf(answers.moved_world().value()).value();
    ASSERT_EQ(moved.size(), 1U);
    EXPECT_EQ(moved[0].header.frame_id, "world");
    EXPECT_EQ(moved[0].child_frame_id, "map");
    EXPECT_EQ(moved[0].translation, T_world_map.translation);
    EXPECT_EQ(moved[0].header.stamp.ns, 1'100'000'000 + k) << "tf2 drops what repeats a stamp";
    EXPECT_FALSE(answers.moved_world());
  }
  answers.hear_world("", std::nullopt);
  EXPECT_FALSE(answers.moved_world());
}

TEST(RosAnswers, FramesAreMadeOfOdometrys) {
  EXPECT_EQ(RosAnswers("odom", "", 0.0).map_frame(), "map");
  EXPECT_EQ(RosAnswers("camera_init", "", 0.0).map_frame(), "map");
  EXPECT_EQ(RosAnswers("r1/odom", "world", 0.0).map_frame(), "world");
}

/// Small turns and shifts of T_map_odom, as many as there are, move the body by the covariance.
TEST(RosAnswers, TheCovarianceIsThatOfTheBodyAboutTheMapsAxes) {
  const Pose3 T_odom_body{Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized())),
                          {10, -4, 2}};
  const Pose3 T_map_body = kMapOdom * T_odom_body;
  for (int k = 0; k < 6; ++k) {
    constexpr double kSmall = 1e-6;
    Vector6d step = Vector6d::Zero();
    step[k] = kSmall;
    const Pose3 moved = retract(kMapOdom, step) * T_odom_body;
    Vector6d expected;
    const Eigen::AngleAxisd turn(moved.rotation * T_map_body.rotation.conjugate());
    expected << moved.translation - T_map_body.translation, turn.angle() * turn.axis();
    const auto sent = ros_covariance(step * step.transpose(), kMapOdom, T_map_body);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(sent[static_cast<std::size_t>(6 * i + j)], expected[i] * expected[j], 1e-16) << k << i << j;
  }
}

TEST(RosAnswers, ThePathIsTheCorrectedTrajectoryAndOdometrySince) {
  RosAnswers answers("odom", "", 0.0);
  const auto at = [](double x) { return Pose3{Eigen::Quaterniond::Identity(), {x, 0, 0}}; };
  for (int i = 0; i < 10; ++i) answers.hear(answer(i, at(i)), at(i));
  answers.hear(
      FeedTrajectory{.map_age = {1, 1}, .constraints = 1, .corrected = {{{0}, at(50)}, {{4}, at(54)}}, .map = {}});
  const std::string path = answers.path();
  // header (8, "map"), count, then of each a header, seven numbers: 2 of the trajectory, 5 to 9 of odometry
  constexpr std::size_t kHead = 4 + 8 + 4 + 4 + 4, kPose = 8 + 4 + 4 + 56;
  EXPECT_NEAR(static_cast<double>(path.size()), static_cast<double>(kHead + 7 * kPose), 16.0);
}

TEST(RosAnswers, TeamMatesWhosePlaceIsKnownAreShown) {
  RosAnswers answers("r1/odom", "", 0.0);
  answers.hear(std::vector<TeamMate>{{RobotId{2}, "bravo-2", {7}, kMapOdom}, {RobotId{3}, "far", {8}, {}}});
  const auto mates = answers.team_mate_poses();
  ASSERT_EQ(mates.size(), 1U);
  EXPECT_EQ(mates[0].first, "bravo_2");
  const auto pose = bags::decode_pose_stamped(mates[0].second).value();
  EXPECT_EQ(pose.header.frame_id, "r1/map");
  EXPECT_EQ(pose.header.stamp.ns, 7);
  EXPECT_EQ(pose.pose.position, kMapOdom.translation);
  const std::string markers = answers.team_mates();
  EXPECT_NE(markers.find("bravo-2"), std::string::npos);
  EXPECT_EQ(markers.find("far"), std::string::npos);
}

TEST(RosAnswers, NamesBecomePartsOfTopics) {
  EXPECT_EQ(topic_part("alpha"), "alpha");
  EXPECT_EQ(topic_part("a--b"), "a_b");
  EXPECT_EQ(topic_part("7"), "robot_7");
  EXPECT_EQ(topic_part(""), "robot_");
}

}  // namespace ros_answers_test
}  // namespace tutti::program
