// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/mission/report/report_example.hpp"

namespace tutti::mission {
namespace geometry_test {

TEST(RobotGeometry, ErrorsAreAgainstTheReferenceWhateverTheFrames) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 50});
  RobotRecord& robot = record.robots[0];
  const Pose3 T_any{so3_exp({0.3, -0.2, 1.9}), {50.0, -20.0, 3.0}};
  robot.server_estimate = test::moved(T_any, robot.reference);
  robot.policies[2].corrected = test::moved(T_any.inverse(), robot.reference);
  const RobotGeometry g = robot_geometry(record, robot);
  EXPECT_TRUE(g.has_reference);
  ASSERT_EQ(g.errors.size(), 50U);
  double onboard_m = 0.0;
  for (std::size_t k = 0; k < g.errors.size(); ++k) {
    EXPECT_NEAR(g.errors[k].server_m, 0.0, 1e-9);
    EXPECT_NEAR(g.errors[k].corrected_m, 0.0, 1e-9);
    EXPECT_NEAR((g.corrected[k] - robot.reference[k].pose.translation).norm(), 0.0, 1e-9);
    onboard_m = std::max(onboard_m, g.errors[k].onboard_m);
    if (k > 0) {
      EXPECT_GE(g.errors[k].distance_m, g.errors[k - 1].distance_m);
    }
  }
  EXPECT_GT(onboard_m, 0.01);
}

TEST(RobotGeometry, WithoutReferenceTheServerIsTheBase) {
  const MissionRecord record = test::example_record({.robots = 1, .keyframes = 30, .reference = false});
  const RobotGeometry g = robot_geometry(record, record.robots[0]);
  EXPECT_FALSE(g.has_reference);
  EXPECT_TRUE(g.reference.empty());
  ASSERT_EQ(g.errors.size(), 30U);
  EXPECT_TRUE(std::isnan(g.errors[3].server_m));
  EXPECT_LT(g.errors[3].corrected_m, 0.3);
  EXPECT_NEAR((g.server[3] - record.robots[0].server_estimate[3].pose.translation).norm(), 0.0, 1e-9);
}

TEST(RobotGeometry, NewDriftIsWhereTheOdometryWentWrong) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 80});
  RobotRecord& robot = record.robots[0];
  robot.odometry = test::moved({so3_exp({0.0, 0.1, 2.0}), {3.0, 4.0, 5.0}}, robot.reference);
  const Pose3 slip{Eigen::Quaterniond::Identity(), {0.7, 0.0, 0.0}};
  for (std::size_t k = 40; k < 80; ++k)  // one slip between keyframes 39 and 40
    robot.odometry[k].pose =
        robot.odometry[39].pose * slip * robot.reference[39].pose.inverse() * robot.reference[k].pose;
  const RobotGeometry g = robot_geometry(record, robot);
  for (std::size_t k = 0; k < 80; ++k) {
    if (k < 10)  // a keyframe every 2 s: the window of 20 s is not full before
      EXPECT_TRUE(std::isnan(g.errors[k].born_m));
    else
      EXPECT_NEAR(g.errors[k].born_m, k >= 40 && k < 50 ? 0.7 : 0.0, 1e-6) << k;
  }
}

}  // namespace geometry_test
}  // namespace tutti::mission
