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

TEST(ClosureStrokes, LeaveOutWhatLiesInAnotherComponent) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 30});
  const auto node = [&](std::size_t i) { return record.server.nodes[i].id; };
  record.server.closures = {{node(0), node(19)}, {node(0), node(20)}};
  const auto drawn = [&](std::uint32_t component) {
    return closure_strokes(record, component, {{}, {}, PlanView({}, 100.0, 100.0)}).intra.size();
  };
  EXPECT_EQ(drawn(record.robots[0].component), 2U);
  EXPECT_EQ(drawn(record.robots[0].component + 1), 0U);
  record.robots[0].server_estimate.resize(20);  // the last ten are not joined to the first
  EXPECT_EQ(drawn(record.robots[0].component), 1U);
}

TEST(Stretch, HasOnePoseMoreOnEitherSide) {
  Trajectory trajectory;
  for (std::int64_t t = 0; t < 100; t += 10) trajectory.push_back({Timestamp{t}, {}});
  using P = std::pair<std::size_t, std::size_t>;
  EXPECT_EQ(stretch(trajectory, Timestamp{30}, Timestamp{50}), P(2, 7));
  EXPECT_EQ(stretch(trajectory, Timestamp{31}, Timestamp{32}), P(3, 5));
  EXPECT_EQ(stretch(trajectory, Timestamp{-5}, Timestamp{500}), P(0, 10));
  EXPECT_EQ(stretch(trajectory, Timestamp{-9}, Timestamp{-5}), P(0, 1));
  EXPECT_EQ(stretch(trajectory, Timestamp{200}, Timestamp{300}), P(9, 10));
  EXPECT_EQ(stretch({}, Timestamp{0}, Timestamp{1}), P(0, 0));
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

}  // namespace geometry_test
}  // namespace tutti::mission
