// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/cloud_bytes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace tutti::page {
namespace cloud_bytes_test {

struct Read {
  float step_m = 0.0F;
  std::uint32_t count = 0;
  std::vector<Eigen::Vector3d> points;
};
Read read(const std::string& bytes) {
  Read out;
  std::memcpy(&out.step_m, bytes.data(), 4);
  std::memcpy(&out.count, bytes.data() + 4, 4);
  for (std::size_t at = 8; at < bytes.size(); at += 6) {
    std::int16_t steps[3];
    std::memcpy(steps, bytes.data() + at, 6);
    out.points.emplace_back(steps[0] * double{out.step_m}, steps[1] * double{out.step_m},
                            steps[2] * double{out.step_m});
  }
  return out;
}

PointCloud line(std::size_t count, float reach_m) {
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i)
    cloud.points.emplace_back(reach_m * static_cast<float>(i) / static_cast<float>(count), 1.0F, -2.0F);
  return cloud;
}

TEST(CloudBytes, HasEveryPointToHalfAStep) {
  for (const float reach_m : {1.0F, 50.0F, 5000.0F}) {
    const Read back = read(cloud_bytes(line(100, reach_m), 1000));
    ASSERT_EQ(back.count, 100U);
    ASSERT_EQ(back.points.size(), 100U);
    std::vector<double> along;
    for (const Eigen::Vector3d& point : back.points) along.push_back(point.x());
    std::ranges::sort(along);
    for (std::size_t i = 0; i < along.size(); ++i)
      EXPECT_NEAR(along[i], reach_m * static_cast<double>(i) / 100.0, 0.51 * back.step_m);
  }
}

TEST(CloudBytes, APrefixIsAThinnerCloud) {
  const Read back = read(cloud_bytes(line(10'000, 100.0F), 200));
  ASSERT_EQ(back.count, 200U);
  double sum = 0.0;
  for (const Eigen::Vector3d& point : back.points) sum += point.x();
  EXPECT_NEAR(sum / 200.0, 50.0, 10.0);
  EXPECT_EQ(cloud_bytes(line(10'000, 100.0F), 200), cloud_bytes(line(10'000, 100.0F), 200)) << "the same every time";
}

TEST(CloudBytes, LeavesOutWhatIsNoPoint) {
  PointCloud cloud = line(3, 1.0F);
  cloud.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  cloud.points.emplace_back(0.0F, std::numeric_limits<float>::infinity(), 0.0F);
  EXPECT_EQ(read(cloud_bytes(cloud, 100)).count, 3U);
  EXPECT_EQ(read(cloud_bytes({}, 100)).count, 0U);
}

}  // namespace cloud_bytes_test
}  // namespace tutti::page
