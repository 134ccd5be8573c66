// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/point_cloud.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <ctime>
#include <limits>

#include "support/bags/robot_bag.hpp"

namespace tutti::bags {
namespace point_cloud_test {

using namespace test;

const std::vector<Eigen::Vector3f> kPoints{{1, 2, 3}, {-4, 5.5F, 6}, {7, 8, -9}, {0, 0.25F, 1}};
const std::vector<double> kTimes{0.0, 0.01, 0.02, 0.1};

Result<formats::TimedCloud> cloud_in(const CloudShape& shape, std::vector<Eigen::Vector3f> points = kPoints) {
  const std::string bytes = cloud_of(Timestamp{5}, "lidar", points, kTimes, shape);
  return to_timed_cloud(decode_point_cloud(bytes).value());
}

TEST(PointCloud, PointsAndTimesAreReadInEveryShape) {
  for (const bool big : {false, true})
    for (const bool doubles : {false, true})
      for (const std::uint32_t rows : {1U, 2U})
        for (const std::uint32_t padding : {0U, 5U})
          for (const std::uint8_t type : {std::uint8_t{6}, std::uint8_t{7}, std::uint8_t{8}})
            for (const char* const name : {"", "t", "offset_time"}) {
              const double unit_s = type == 6 ? 1e-9 : 1.0;
              const auto cloud = cloud_in({big, doubles, name, type, unit_s, rows, padding, ""});
              ASSERT_TRUE(cloud) << cloud.error().message;
              EXPECT_EQ(cloud->cloud.points, kPoints);
              EXPECT_EQ(cloud->time_field, name);
              ASSERT_EQ(cloud->times.size(), cloud->time_field.empty() ? 0U : 4U);
              for (std::size_t i = 0; i < cloud->times.size(); ++i)
                EXPECT_NEAR(cloud->times[i] * unit_s, kTimes[i], 1e-8);
            }
}

/// As a PointCloud2 that has the same points and times, whoever wrote them.
RC_GTEST_PROP(PointCloud, PointsAndTimesOfALivoxAreThoseOfACloud, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(0, 40);
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  std::vector<Eigen::Vector3f> points;
  std::vector<double> times;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(rng.uniform(-50.0, 50.0), rng.uniform(-50.0, 50.0), rng.uniform(-5.0, 5.0));
    times.push_back(1e-9 * static_cast<double>(rng.index(100'000'000)));
  }
  const CloudShape shape{.time_field = "offset_time", .time_type = 6, .time_unit_s = 1e-9};
  const std::string bytes = cloud_of(Timestamp{5}, "lidar", points, times, shape);
  const auto expected = to_timed_cloud(decode_point_cloud(bytes).value()).value();
  for (const int how : {0, 1, 2}) {
    const std::string written = livox_of(Timestamp{5}, "lidar", points, times, how);
    const auto message = decode_livox(written, how == 2 ? RosEncoding::ros1 : RosEncoding::cdr);
    RC_ASSERT(message.has_value());
    RC_ASSERT(message->header.stamp.ns == 5 && message->header.frame_id == "lidar");
    const auto cloud = to_timed_cloud(*message).value();
    RC_ASSERT(cloud.cloud.points == expected.cloud.points && cloud.cloud.points == points);
    RC_ASSERT(cloud.times == expected.times && cloud.time_field == expected.time_field);
  }
}

TEST(PointCloud, PointsThatAreNoneAreLeftOutWithTheirTimes) {
  auto points = kPoints;
  points[1].y() = std::numeric_limits<float>::quiet_NaN();
  const auto cloud = cloud_in({.time_field = "time", .time_type = 8}, points).value();
  EXPECT_EQ(cloud.cloud.points.size(), 3U);
  EXPECT_EQ(cloud.times, (std::vector<double>{0.0, 0.02, 0.1}));
}

TEST(PointCloud, BeamsWithoutAnEchoAreLeftOutWithTheirTimes) {
  auto points = kPoints;
  points[2] = Eigen::Vector3f::Zero();
  const auto cloud = cloud_in({.time_field = "time", .time_type = 8}, points).value();
  EXPECT_EQ(cloud.cloud.points, (std::vector<Eigen::Vector3f>{kPoints[0], kPoints[1], kPoints[3]}));
  EXPECT_EQ(cloud.times, (std::vector<double>{0.0, 0.01, 0.1}));
  const std::string bytes = livox_of(Timestamp{5}, "lidar", points, kTimes);
  EXPECT_EQ(to_timed_cloud(decode_livox(bytes).value())->cloud.points, cloud.cloud.points);
}

TEST(PointCloud, WhatIsWrongIsNamed) {
  const auto error_of = [](const RosPointCloud& message) { return to_timed_cloud(message).error().message; };
  EXPECT_EQ(cloud_in({.without = "z"}).error().message, "no field 'z', expected x, y and z among 'x y'");
  const std::string bytes = cloud_of(Timestamp{5}, "lidar", kPoints);
  const RosPointCloud good = decode_point_cloud(bytes).value();
  RosPointCloud bad = good;
  bad.fields[1].datatype = 4;
  EXPECT_EQ(error_of(bad), "field 'y' has datatype 4, expected 7 (float32) or 8 (float64)");
  bad = good;
  bad.fields[2].offset = 13;
  EXPECT_EQ(error_of(bad), "field 'z' at byte 13 of points of 16 bytes");
  bad = good;
  bad.width = 5;
  EXPECT_EQ(error_of(bad), "64 bytes of points, expected 80 (1 rows of 5 points of 16 bytes)");
  bad.width = 2;
  bad.height = 2;
  bad.row_step = 31;
  EXPECT_EQ(error_of(bad), "row_step 31, expected at least 2 x 16");
  for (const std::uint32_t huge : {0xffff'ffffU, 0x8000'0000U}) {  // no memory is taken for what is not there
    bad = good;
    bad.height = bad.width = bad.row_step = bad.point_step = huge;
    EXPECT_FALSE(to_timed_cloud(bad));
    bad.height = 1;
    EXPECT_FALSE(to_timed_cloud(bad));
  }
}

/// Four thousand million rows took 4 s.
TEST(PointCloud, RowsWithoutPointsCostNothing) {
  RosPointCloud none = decode_point_cloud(cloud_of(Timestamp{5}, "lidar", kPoints)).value();
  none.width = none.row_step = 0;
  none.height = 0xffff'ffffU;
  none.data = {};
  const std::clock_t begin = std::clock();
  const auto cloud = to_timed_cloud(none);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_TRUE(cloud->cloud.points.empty());
  EXPECT_LT(std::clock() - begin, CLOCKS_PER_SEC / 4);
}

TEST(PointCloud, WhatIsMadeOfPointsIsReadAsTheyAre) {
  const RosPointCloud message = to_point_cloud({Timestamp{5}, "lidar"}, kPoints);
  const auto cloud = to_timed_cloud(message);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->cloud.points, kPoints);
  EXPECT_TRUE(cloud->times.empty());
  EXPECT_EQ(message.point_step, 12U);

  constexpr float kNoTime = std::numeric_limits<float>::quiet_NaN();
  const std::array<float, 12> timed{1, 2, 3, -0.5F, 7, 8, 9, kNoTime, 4, 5, 6, 0};
  const auto with_times = to_timed_cloud(to_point_cloud({Timestamp{5}, "lidar"}, {"x", "y", "z", "time"},
                                                        {reinterpret_cast<const char*>(timed.data()), sizeof timed}));
  ASSERT_TRUE(with_times) << with_times.error().message;
  EXPECT_EQ(with_times->cloud.points, (std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(with_times->times, (std::vector<double>{-0.5, 0}));
}

}  // namespace point_cloud_test
}  // namespace tutti::bags
