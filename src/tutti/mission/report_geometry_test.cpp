// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report_geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/mission/testing/report_example.hpp"

namespace tutti::mission {
namespace {

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

TEST(JointDisplay, UndoesTheServersFrame) {
  MissionRecord record = test::example_record({.robots = 3, .keyframes = 40});
  const Pose3 T_world_reference{so3_exp({0.1, 0.0, -2.0}), {7.0, 8.0, 9.0}};
  for (auto& robot : record.robots) robot.server_estimate = test::moved(T_world_reference, robot.reference);
  const Pose3 identity = display_T_reference_world(record) * T_world_reference;
  EXPECT_NEAR(identity.translation.norm(), 0.0, 1e-9);
  EXPECT_NEAR(rotation_angle(identity), 0.0, 1e-9);
}

TEST(JointDisplay, LargestComponentWins) {
  MissionRecord record = test::example_record({.robots = 3, .keyframes = 5});
  record.robots[0].component = 4;
  record.robots[1].component = record.robots[2].component = 9;
  EXPECT_EQ(largest_component(record), 9U);
  EXPECT_EQ(largest_component(MissionRecord{}), 0U);
}

TEST(GroundPlane, LooksFromAbove) {
  const auto axes = [](double x, double y, double z) {
    const GroundPlane ground = ground_plane({{{0.0, 0.0, 0.0}, {x, y, z}}});
    return std::pair(ground.right, ground.up);
  };
  using P = std::pair<Eigen::Index, Eigen::Index>;
  EXPECT_EQ(axes(20.0, 15.0, 2.0), P(0, 1));
  EXPECT_EQ(axes(15.0, 12.0, 9.0), P(0, 1));     // a drone that climbs
  EXPECT_EQ(axes(500.0, 20.0, 400.0), P(0, 2));  // a camera frame: y is down
  EXPECT_EQ(axes(100.0, 0.01, 0.2), P(0, 1));    // a straight line on the ground
  EXPECT_EQ(ground_plane({}).up, 1);
}

TEST(FindPosition, OnlyExactStamps) {
  const Trajectory trajectory{{Timestamp{10}, {}}, {Timestamp{20}, {Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}}}};
  ASSERT_NE(find_position(trajectory, Timestamp{20}), nullptr);
  EXPECT_EQ(find_position(trajectory, Timestamp{20})->z(), 3.0);
  EXPECT_EQ(find_position(trajectory, Timestamp{19}), nullptr);
  EXPECT_EQ(find_position({}, Timestamp{19}), nullptr);
}

}  // namespace
}  // namespace tutti::mission
