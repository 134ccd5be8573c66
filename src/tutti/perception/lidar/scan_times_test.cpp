// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/scan_times.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace tutti::lidar {
namespace scan_times_test {

using Zero = PointTimes::Zero;

/// As many points as times.
formats::TimedCloud scan_with(std::vector<double> times) {
  formats::TimedCloud scan{.cloud = {}, .time_field = "t", .times = std::move(times)};
  scan.cloud.points.resize(scan.times.size());
  return scan;
}

/// Eleven points over `sweep_s`, by a clock that shows `begin` units when the sweep begins.
formats::TimedCloud sweep(double begin, double sweep_s, double unit_s) {
  std::vector<double> times;
  for (int i = 0; i <= 10; ++i) times.push_back(begin + 0.1 * i * sweep_s / unit_s);
  return scan_with(times);
}

std::string problem(formats::TimedCloud scan, const ScanTimesConfig& config = {}) {
  const auto found = find_point_times(scan, Timestamp{}, config);
  return found ? "" : found.error().message;
}

RC_GTEST_PROP(ScanTimes, UnitAndZeroAreFoundAndAgesFollow, ()) {
  const auto [unit, unit_s] = *rc::gen::elementOf(
      std::vector<std::pair<std::string, double>>{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  const double sweep_s = 0.001 * *rc::gen::inRange(2, 500);
  const auto zero = *rc::gen::element(Zero::sweep_begin, Zero::sweep_end, Zero::odometry_clock, Zero::unknown);
  ScanTimesConfig config;
  config.pose_at = *rc::gen::element(std::string("begin"), std::string("end"));
  const bool pose_at_begin = config.pose_at == "begin";
  const Timestamp pose{1'700'000'000'000'000'000};
  const double pose_s = 1.7e9, begin_s = pose_at_begin ? pose_s : pose_s - sweep_s;
  double begin = 0.0;
  if (zero == Zero::sweep_end) begin = -sweep_s / unit_s;
  if (zero == Zero::odometry_clock) begin = begin_s / unit_s;
  if (zero == Zero::unknown) begin = 12'345.0 / unit_s;
  formats::TimedCloud scan = sweep(begin, sweep_s, unit_s);
  const auto found = find_point_times(scan, pose, config);
  RC_ASSERT(found.has_value() && found->has_value());
  RC_ASSERT((*found)->unit == unit);
  RC_ASSERT((*found)->zero == zero);
  const auto ages = point_ages(scan, pose, **found);
  RC_ASSERT(ages.has_value() && ages->size() == 11);
  for (int i = 0; i <= 10; ++i)
    RC_ASSERT(std::abs((*ages)[i] - (pose_at_begin ? -0.1 * i : 1.0 - 0.1 * i) * sweep_s) < 2e-6);
}

TEST(ScanTimes, TheFirstPointsOfASweepMayBeMissing) {
  ScanTimesConfig config;
  config.pose_at = "begin";
  formats::TimedCloud scan = scan_with({4e6, 50e6, 100e6});  // ns since the begin
  const auto times = find_point_times(scan, Timestamp{}, config);
  ASSERT_TRUE(times && *times);
  EXPECT_NEAR(point_ages(scan, Timestamp{}, **times)->at(0), -0.004, 1e-7);
}

TEST(ScanTimes, NoTimesAreTakenAsDeskewed) {
  const ScanTimesConfig any;
  for (formats::TimedCloud scan : {scan_with({}), scan_with({0.0, 0.0, 0.0}), scan_with({1.7e9, 1.7e9})})
    EXPECT_EQ(find_point_times(scan, Timestamp{}, any).value(), std::nullopt);
  ScanTimesConfig config;
  config.deskewed = "yes";
  formats::TimedCloud some = sweep(0.0, 0.1, 1.0);
  EXPECT_EQ(find_point_times(some, Timestamp{}, config).value(), std::nullopt);
  config.deskewed = "no";
  EXPECT_EQ(problem(scan_with({}), config), "points carry no time, but scans_deskewed is 'no'");
  EXPECT_EQ(problem(scan_with({5.0, 5.0}), config), "all points have the same t, but scans_deskewed is 'no'");
}

TEST(ScanTimes, NumbersThatAreNoSweepsAreRefused) {
  EXPECT_NE(problem(scan_with({0.0, 0.25, 0.75})).find("t goes from 0 to 0.75, expected a sweep of 0.001 to 0.5 s"),
            std::string::npos)
      << problem(scan_with({0.0, 0.25, 0.75}));
  EXPECT_NE(problem(scan_with({1.7e9, 1.7e9 + 128.0, 1.7e9})), "");  // a clock in floats, not 128 ms
  EXPECT_NE(problem(scan_with({0.0, std::nan(""), 0.1})).find("t of point 1 is nan"), std::string::npos);
  ScanTimesConfig stated;
  stated.unit = "s";
  EXPECT_NE(problem(sweep(0.0, 0.1, 1e-9), stated), "");
  EXPECT_EQ(problem(sweep(0.0, 0.1, 1.0), stated), "");
  const PointTimes times{.field = "t", .unit = "ms", .unit_s = 1e-3, .zero = Zero::odometry_clock};
  EXPECT_FALSE(point_ages(scan_with({}), Timestamp{}, times));
  EXPECT_FALSE(point_ages(scan_with({5000.0, 5050.0, 5100.0}), Timestamp{}, times));  // 5 s from its pose
  EXPECT_FALSE(point_ages(scan_with({0.0, 50.0, 700.0}), Timestamp{}, times));
  EXPECT_TRUE(point_ages(scan_with({0.0, 50.0, 400.0}), Timestamp{}, times));
}

/// A few drivers give a few points the time of another sweep, or none at all.
TEST(ScanTimes, FewTimesThatStrayAreLeftOutAndDoNotDecideTheUnit) {
  for (const auto& [unit, unit_s] : {std::pair("s", 1.0), {"ns", 1e-9}}) {
    std::vector<double> times;
    for (int i = 0; i < 200; ++i) times.push_back(0.0005 * i / unit_s);
    times[17] = 3.604 / unit_s;
    times[150] = -40.0 / unit_s;
    auto scan = scan_with(times), judged = scan;
    EXPECT_EQ(find_point_times(judged, Timestamp{}, {}).value()->strays, 2U);
    for (std::size_t i = 0; i < times.size(); ++i) scan.cloud.points[i].x() = static_cast<float>(i);
    EXPECT_EQ(drop_stray_times(scan), 2U);
    ASSERT_EQ(scan.cloud.points.size(), 198U);
    EXPECT_EQ(scan.cloud.points[17].x(), 18.0F);
    EXPECT_EQ(scan.times[17], times[18]);
    const auto found = find_point_times(scan, Timestamp{}, {});
    ASSERT_TRUE(found && *found);
    EXPECT_EQ((*found)->unit, unit);
    EXPECT_EQ(drop_stray_times(scan), 0U);
  }
  auto few = scan_with({0.0, 0.1, 3.6});
  EXPECT_EQ(drop_stray_times(few), 0U);
  auto same = scan_with(std::vector<double>(100, 0.05));
  same.times[3] = 0.0;
  EXPECT_EQ(drop_stray_times(same), 0U);
}

/// More of them stray farther; what a LiDAR in the open sees of its sweep's begin and end is no stray.
TEST(ScanTimes, ATwentiethMayStrayFarAway) {
  std::vector<double> times, open_field;
  for (int i = 0; i < 2000; ++i) {
    times.push_back(i % 20 == 7 ? 7.0 : 0.00005 * i);
    open_field.push_back(i % 10 == 7 ? 0.00005 * i : 0.05 + 0.000002 * i);
  }
  auto scan = scan_with(times), honest = scan_with(open_field);
  const auto found = find_point_times(scan, Timestamp{}, {});
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->unit, "s");
  EXPECT_EQ((*found)->strays, 100U);
  EXPECT_EQ(drop_stray_times(honest), 0U);
}

TEST(ScanTimes, AreReportedInWords) {
  EXPECT_EQ(in_words(std::nullopt), "scans are taken as deskewed to the stamps of their poses");
  EXPECT_EQ(in_words(PointTimes{.field = "t", .unit = "ns", .unit_s = 1e-9, .zero = Zero::sweep_begin}),
            "scans are deskewed by the robot's odometry: their field 't' is taken as ns since the sweep's begin, their "
            "poses as of the sweep's end");
  EXPECT_EQ(
      in_words(PointTimes{.field = "timestamp", .unit = "s", .unit_s = 1.0, .zero = Zero::odometry_clock}),
      "scans are deskewed by the robot's odometry: their field 'timestamp' is taken as s by the odometry's clock");
}

}  // namespace scan_times_test
}  // namespace tutti::lidar
