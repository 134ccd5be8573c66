// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/kidnapped.hpp"

#include <gtest/gtest.h>

#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace kidnapped_test {

constexpr double kStep_s = 0.1;
Timestamp at(std::size_t k) { return Timestamp{} + kStep_s * static_cast<double>(k); }

/// A scan of one point, which says which one it is.
class Numbered final : public ScanSource {
 public:
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    auto cloud = std::make_shared<PointCloud>();
    cloud->points = {{static_cast<float>(sample), 0.0F, 0.0F}};
    return Scan{at(sample), std::move(cloud), nullptr};
  }
};

/// 100 s at 1 m/s in a circle of 40 m; it stands from 30 to 55 s.
Recording recording() {
  Recording out;
  out.name = "alpha";
  double along_m = 0.0;
  for (std::size_t k = 0; k < 1000; ++k) {
    if (k < 300 || k >= 550) along_m += kStep_s;
    const double angle = along_m / 40.0;
    const Pose3 pose{so3_exp({0.0, 0.0, angle}), {40.0 * std::sin(angle), 40.0 - 40.0 * std::cos(angle), 0.0}};
    out.odometry.push_back({at(k), pose});
    out.reference.push_back({at(k), pose});
    if (k > 0) out.increment_covariance.push_back(Matrix6d::Identity() * static_cast<double>(k));
  }
  out.scans = std::make_shared<const Numbered>();
  return out;
}

TEST(Kidnapped, OdometryNoticesNothingAndScansAreOfTheNewPlace) {
  const Recording from = recording();
  const auto made = kidnapped(from, 15.0);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  const Recording& out = made->recording;
  ASSERT_GE(made->at.size(), 2U);
  ASSERT_EQ(out.odometry.size(), out.reference.size());
  EXPECT_EQ(out.increment_covariance.size() + 1, out.odometry.size());
  std::size_t carried = 0;
  for (std::size_t k = 1; k < out.odometry.size(); ++k) {
    EXPECT_NEAR(out.odometry[k].stamp - out.odometry[k - 1].stamp, kStep_s, 1e-6);
    EXPECT_EQ(out.odometry[k].stamp, out.reference[k].stamp);
    EXPECT_LT((out.odometry[k].pose.translation - out.odometry[k - 1].pose.translation).norm(), 1.01 * kStep_s);
    const double moved_m = (out.reference[k].pose.translation - out.reference[k - 1].pose.translation).norm();
    const bool is_carried = std::ranges::find(made->at, out.odometry[k - 1].stamp) != made->at.end();
    EXPECT_EQ(moved_m >= kLeastCarried_m, is_carried) << k;
    carried += is_carried;
    const auto scan = out.scans->scan(k);
    ASSERT_TRUE(scan && *scan);
    EXPECT_EQ((*scan)->stamp, out.scan_stamps[k]);
    const auto old = static_cast<std::size_t>((*scan)->cloud->points.front().x());
    EXPECT_EQ(from.reference[old].pose.translation, out.reference[k].pose.translation);
  }
  EXPECT_EQ(carried, made->at.size());
  EXPECT_TRUE(out.scans->scan(out.odometry.size()).has_value());
}

/// A robot that stood before its second sample is not carried for so long either.
TEST(Kidnapped, TheFirstSampleAfterwardsComesAUsualStepLater) {
  Recording from = recording();
  for (auto* const poses : {&from.odometry, &from.reference}) poses->front().stamp = Timestamp{} - 6.0;
  const auto made = kidnapped(from, 15.0);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  const Trajectory& odometry = made->recording.odometry;
  for (std::size_t k = 2; k < odometry.size(); ++k)
    EXPECT_NEAR(odometry[k].stamp - odometry[k - 1].stamp, kStep_s, 1e-6) << k;
}

TEST(Kidnapped, WhatCannotBeIsSaid) {
  Recording from = recording();
  EXPECT_FALSE(kidnapped(from, 90.0).has_value());
  from.scans = nullptr;
  EXPECT_FALSE(kidnapped(from, 25.0).has_value());
}

}  // namespace kidnapped_test
}  // namespace tutti::mission
