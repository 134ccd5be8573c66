// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/shut_in.hpp"

#include <gtest/gtest.h>

#include "support/localise/tunnel.hpp"

namespace tutti::localise {
namespace shut_in_test {

constexpr double kOnRobot_m = 0.3;

/// Sees the same cloud five times a second, from where the robot drives with this speed; says whether it is shut in.
bool after(ShutIn& one, const PointCloud& cloud, double from_s, double for_s, double mps = 0.0) {
  for (double t = from_s; t <= from_s + for_s + 1e-9; t += 0.2)
    one.see(cloud, kOnRobot_m, {Timestamp{} + t, {Eigen::Quaterniond::Identity(), {mps * t, 0, 0}}});
  return one.is();
}

TEST(ShutIn, ThreeSecondsInALiftAndUntilItsDoorOpens) {
  ShutIn one;
  EXPECT_FALSE(after(one, test::lift(), 0.0, 2.0));
  EXPECT_TRUE(after(one, test::lift(), 2.2, 1.0));
  EXPECT_TRUE(after(one, test::lift(), 3.4, 60.0, 0.01)) << "it turns round in it";
  PointCloud open = test::lift();
  for (std::size_t k = 0; k < open.points.size(); k += 20)  // a door
    open.points[k] *= 8.0F;
  EXPECT_FALSE(after(one, open, 64.0, 0.0));
  EXPECT_FALSE(after(one, test::lift(), 64.2, 2.0));
}

TEST(ShutIn, WhoDrivesIsNotInALift) {
  ShutIn one;
  EXPECT_FALSE(after(one, test::lift(), 0.0, 20.0, 0.5));
}

TEST(ShutIn, StrayPointsAndTheRobotItselfTellNothing) {
  ShutIn one;
  PointCloud cloud = test::lift();
  for (std::size_t k = 0; k < cloud.points.size(); k += 100) cloud.points[k] *= 50.0F;
  EXPECT_TRUE(after(one, cloud, 0.0, 4.0));
  PointCloud robot;
  robot.points.assign(500, Eigen::Vector3f(0.1F, 0, 0));
  EXPECT_TRUE(after(one, robot, 4.2, 1.0)) << "an empty scan changes nothing";
  ShutIn other;
  EXPECT_FALSE(after(other, robot, 0.0, 10.0));
}

}  // namespace shut_in_test
}  // namespace tutti::localise
