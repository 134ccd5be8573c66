// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/undistort.hpp"

#include <gtest/gtest.h>
// gtest before rapidcheck
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "tutti/geometry/so3.hpp"

namespace tutti::lidar {
namespace undistort_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};

/// Constant velocities: turning at `turn` rad/s while moving at `speed` m/s.
Pose3 pose_after(double seconds, const Eigen::Vector3d& speed, const Eigen::Vector3d& turn) {
  return {so3_exp(turn * seconds), speed * seconds};
}

Trajectory drive(const Eigen::Vector3d& speed, const Eigen::Vector3d& turn, const Pose3& T_odom_start, double step_s,
                 int samples) {
  Trajectory out;
  for (int k = 0; k < samples; ++k)
    out.push_back({kStart + k * step_s, T_odom_start * pose_after(k * step_s, speed, turn)});
  return out;
}

/// Fixed points seen from where the body was at each time of the sweep.
Scan sweep(const std::vector<Eigen::Vector3d>& fixed, Timestamp stamp, double sweep_s, const Eigen::Vector3d& speed,
           const Eigen::Vector3d& turn) {
  auto cloud = std::make_shared<PointCloud>();
  auto ages = std::make_shared<std::vector<float>>();
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const auto age = static_cast<float>(sweep_s * (1.0 - static_cast<double>(i) / static_cast<double>(fixed.size())));
    const Pose3 T_start_then = pose_after(stamp - kStart - double{age}, speed, turn);
    cloud->points.push_back((T_start_then.inverse() * fixed[i]).cast<float>());
    ages->push_back(age);
  }
  return {stamp, cloud, ages};
}

Eigen::Vector3d any_vector(double bound) {
  const auto axis = [&] { return bound * 1e-3 * *rc::gen::inRange(-1000, 1001); };
  return {axis(), axis(), axis()};
}

RC_GTEST_PROP(Undistort, FixedPointsComeBackWhereTheyAreWhateverTheOdometryFrame, ()) {
  const Eigen::Vector3d speed = any_vector(3.0), turn = any_vector(1.5);
  const Pose3 T_odom_start{so3_exp(any_vector(3.0)), any_vector(100.0)};
  const Trajectory odometry = drive(speed, turn, T_odom_start, 0.125, 8);
  std::vector<Eigen::Vector3d> fixed;
  for (int i = 0; i < 40; ++i) fixed.push_back(any_vector(20.0));
  const Timestamp stamp = odometry.back().stamp;
  const auto undistorted = undistort(sweep(fixed, stamp, 0.2, speed, turn), odometry);
  RC_ASSERT(undistorted.has_value());
  RC_ASSERT(undistorted->stamp == stamp);
  RC_ASSERT(!undistorted->age_s);
  const Pose3 T_end_start = pose_after(stamp - kStart, speed, turn).inverse();
  for (std::size_t i = 0; i < fixed.size(); ++i)
    RC_ASSERT((undistorted->cloud->points[i].cast<double>() - T_end_start * fixed[i]).norm() < 1e-4);
}

TEST(Undistort, PointsMayBeYoungerThanTheStamp) {
  const Eigen::Vector3d speed(1.0, 0.2, 0.0), turn(0.0, 0.0, 0.5);
  const Trajectory odometry = drive(speed, turn, {}, 0.125, 4);
  Scan scan = sweep({{10.0, 0.0, 0.0}, {3.0, 4.0, 1.0}}, odometry[2].stamp, 0.125, speed, turn);
  const Pose3 T_end_begin = odometry[2].pose.inverse() * odometry[1].pose;
  const auto at_end = undistort(scan, odometry);
  auto younger = std::make_shared<std::vector<float>>(*scan.age_s);
  for (float& age_s : *younger) age_s -= 0.125F;
  scan.stamp = odometry[1].stamp;  // of the same sweep's begin
  scan.age_s = younger;
  const auto at_begin = undistort(scan, odometry);
  ASSERT_TRUE(at_end && at_begin);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT(
        (T_end_begin * at_begin->cloud->points[i].cast<double>() - at_end->cloud->points[i].cast<double>()).norm(),
        1e-5);
}

TEST(Undistort, WithoutItAMovingSweepIsBent) {
  const Eigen::Vector3d speed(1.0, 0.0, 0.0), turn(0.0, 0.0, 0.5);
  const Trajectory odometry = drive(speed, turn, {}, 0.125, 4);
  const Scan scan = sweep({{10.0, 0.0, 0.0}}, odometry.back().stamp, 0.1, speed, turn);
  const auto undistorted = undistort(scan, odometry);
  ASSERT_TRUE(undistorted.has_value());
  // 0.1 s: 0.1 m ahead and, 10 m away, 0.5 m to the side.
  EXPECT_GT((scan.cloud->points[0] - undistorted->cloud->points[0]).norm(), 0.4F);
}

TEST(Undistort, AScanWithoutAgesIsLeftAlone) {
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{1.0F, 2.0F, 3.0F}}});
  const auto out = undistort({kStart, cloud, nullptr}, {});
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->cloud, cloud);
}

TEST(Undistort, BadSweepsAreRefusedWithTheReason) {
  const Trajectory odometry = drive({1.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), {}, 0.125, 2);
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{1.0F, 2.0F, 3.0F}, {1.0F, 0.0F, 0.0F}}});
  const auto refusal = [&](std::vector<float> ages, Timestamp stamp, std::span<const StampedPose> samples) {
    const auto out = undistort({stamp, cloud, std::make_shared<const std::vector<float>>(std::move(ages))}, samples);
    return out.has_value() ? std::string() : out.error().message;
  };
  const Timestamp stamp = odometry.back().stamp;
  EXPECT_EQ(refusal({0.125F, 0.0F}, stamp, odometry), "");
  EXPECT_NE(refusal({0.1F}, stamp, odometry).find("1 ages for 2 points"), std::string::npos);
  EXPECT_NE(refusal({0.1F, -0.01F}, stamp, odometry).find("point 1 is -0.01"), std::string::npos);
  EXPECT_NE(refusal({0.2F, 0.1F}, stamp, odometry).find("point 0 is 0.2"), std::string::npos);
  EXPECT_NE(refusal({std::numeric_limits<float>::quiet_NaN(), 0.1F}, stamp, odometry).find("nan"), std::string::npos);
  EXPECT_NE(refusal({0.1F, 0.0F}, stamp, {}).find("odometry ends"), std::string::npos);
  EXPECT_NE(refusal({0.1F, 0.0F}, stamp + 1.0, odometry).find("odometry ends"), std::string::npos);
  EXPECT_FALSE(undistort({stamp, nullptr, nullptr}, odometry).has_value());
}

}  // namespace undistort_test
}  // namespace tutti::lidar
