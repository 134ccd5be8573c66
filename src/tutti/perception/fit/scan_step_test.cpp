// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/scan_step.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/perception/lidar/rooms.hpp"

namespace tutti::fit {
namespace scan_step_test {

using lidar::test::Walk;

/// A LiDAR sees this from one place.
FitScan scan_at(const lidar::test::World& world, const Eigen::Vector3d& position, double yaw_rad, std::uint64_t seed) {
  const Walk stand{.from = position, .to = position, .yaw_rad = yaw_rad, .keyframes = 1};
  return make_fit_scan(Timestamp{static_cast<std::int64_t>(seed) * 400'000'000},
                       lidar::test::observe(world, stand, Rng(seed)), 0.5);
}

const Pose3 kMotion{so3_exp({0, 0, 0.2}), {0.35, 0.1, 0.0}};

TEST(ScanStep, FindsTheMotionWhateverOdometrySays) {
  const auto world = lidar::test::furnished_room();
  const FitScan from = scan_at(world, {5, 5, 1.2}, 0.0, 1), to = scan_at(world, {5.35, 5.1, 1.2}, 0.2, 2);
  for (const Pose3& odometry : {kMotion, Pose3{}, kMotion.inverse(), Pose3{so3_exp({0, 0, -0.2}), {0.0, -0.6, 0.0}}}) {
    const auto step = step_between(from, to, odometry);
    ASSERT_TRUE(step.has_value());
    const Vector6d error = local(kMotion, step->T_from_to);
    EXPECT_LT(error.head<3>().norm(), 0.03) << odometry.translation.transpose();
    EXPECT_LT(error.tail<3>().norm(), 0.5 * kRadPerDeg);
    EXPECT_LE(step->registrations, 3);
    EXPECT_EQ(step->from, from.stamp);
    EXPECT_EQ(step->to, to.stamp);
  }
}

TEST(ScanStep, TakesOneRegistrationWhereOdometryIsRight) {
  const auto world = lidar::test::furnished_room();
  const FitScan from = scan_at(world, {5, 5, 1.2}, 0.0, 1), to = scan_at(world, {5.35, 5.1, 1.2}, 0.2, 2);
  EXPECT_EQ(step_between(from, to, kMotion)->registrations, 1);
}

TEST(ScanStep, BeginsWhereASteadyBodyWouldBe) {
  const auto world = lidar::test::furnished_room();
  const Pose3 motion{so3_exp({0, 0, 0.6}), {1.2, 0.3, 0.0}};
  const FitScan from = scan_at(world, {5, 5, 1.2}, 0.0, 1), to = scan_at(world, {6.2, 5.3, 1.2}, 0.6, 2);
  const ScanStep before{
      .from = from.stamp, .to = from.stamp + 0.5, .T_from_to = {so3_exp({0, 0, 0.3}), 0.5 * motion.translation}};
  const auto step = step_between(from, to, Pose3{}, steady_motion(before, 1.0));
  ASSERT_TRUE(step.has_value());
  EXPECT_LT(local(motion, step->T_from_to).head<3>().norm(), 0.05);
}

TEST(ScanStep, SaysThatAlongACorridorItDoesNotKnow) {
  const auto world = lidar::test::corridor();
  const FitScan from = scan_at(world, {40, 1.3, 1.2}, 0.0, 1), to = scan_at(world, {40.35, 1.3, 1.2}, 0.0, 2);
  const auto step = step_between(from, to, Pose3{Eigen::Quaterniond::Identity(), {-0.4, 0, 0}});
  ASSERT_TRUE(step.has_value());
  EXPECT_GT(std::sqrt(step->covariance(0, 0)), 0.3);
  EXPECT_LT(std::sqrt(step->covariance(1, 1)), 0.05);
}

TEST(ScanStep, OtherPlacesAndEmptyScansGiveNone) {
  const auto world = lidar::test::furnished_room();
  const FitScan room = scan_at(world, {5, 5, 1.2}, 0.0, 1),
                corridor = scan_at(lidar::test::corridor(), {40, 1.3, 1.2}, 0.5, 2);
  EXPECT_FALSE(step_between(room, corridor, Pose3{}).has_value());
  const FitScan empty = make_fit_scan(Timestamp{5}, {}, 0.5);
  EXPECT_FALSE(step_between(empty, room, Pose3{}).has_value());
  EXPECT_FALSE(step_between(room, empty, Pose3{}).has_value());
  EXPECT_EQ(empty.cloud.size(), 0U);
}

}  // namespace scan_step_test
}  // namespace tutti::fit
