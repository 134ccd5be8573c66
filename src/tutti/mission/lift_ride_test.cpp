// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/lift_ride.hpp"

#include <gtest/gtest.h>

#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace lift_ride_test {

constexpr double kStep_s = 0.5;

/// A scan of one point, which says whose it is and which.
class Numbered final : public ScanSource {
 public:
  explicit Numbered(float who) : who_(who) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    auto cloud = std::make_shared<PointCloud>();
    cloud->points.emplace_back(who_, static_cast<float>(sample), 0.0F);
    return std::optional(Scan{.stamp = {}, .cloud = std::move(cloud), .age_s = nullptr});
  }

 private:
  float who_;
};

/// Drives 1 m a sample in a direction of its own, from a time and place of its own.
Recording recording(std::uint32_t number, std::size_t samples) {
  Recording out;
  out.robot = RobotId{number};
  out.name = number == 0 ? "charlie" : "delta";
  for (std::size_t k = 0; k < samples; ++k) {
    const auto x = static_cast<double>(k);
    const Pose3 step{so3_exp({0, 0, 0.7 * number}), {x, 3.0 * number, 15.0 * number}};
    out.reference.push_back({Timestamp{} + (100.0 * number + kStep_s * x), step});
    out.odometry.push_back({out.reference.back().stamp, out.reference.front().pose.inverse() * step});
    if (k > 0) out.increment_covariance.push_back(Matrix6d::Identity() * (number + 1.0));
  }
  out.scans = std::make_shared<const Numbered>(static_cast<float>(100 * (number + 1)));
  return out;
}

TEST(LiftRide, HalfOfOneWayAStandingRideAndHalfOfTheOthers) {
  const Recording before = recording(0, 20), after = recording(1, 30);
  const auto made = ride_lift(before, after);
  ASSERT_TRUE(made.has_value());
  const Recording& out = made->recording;
  const auto ride = static_cast<std::size_t>(kRide_s / kStep_s);
  ASSERT_EQ(out.odometry.size(), 10 + ride + 15);
  EXPECT_EQ(out.increment_covariance.size() + 1, out.odometry.size());
  EXPECT_EQ(out.robot, before.robot);
  EXPECT_EQ(made->at, (std::vector<Timestamp>{before.odometry[9].stamp}));
  for (std::size_t k = 1; k < out.odometry.size(); ++k) {
    EXPECT_NEAR(out.odometry[k].stamp - out.odometry[k - 1].stamp, kStep_s, 1e-9) << k;
    const Pose3 step = out.odometry[k - 1].pose.inverse() * out.odometry[k].pose;
    EXPECT_NEAR(step.translation.norm(), k >= 10 && k <= 10 + ride ? 0.0 : 1.0, 1e-9) << k;
    const double covariance = out.increment_covariance[k - 1](0, 0);
    EXPECT_EQ(covariance, k < 10 ? 1.0 : k < 10 + ride ? 0.0 : 2.0) << k;
  }
  ASSERT_EQ(out.reference.size(), 10U + 15U);  // none in the lift
  EXPECT_EQ(out.reference[9].pose, before.reference[9].pose);
  EXPECT_EQ(out.reference[10].pose, after.reference[15].pose);
  EXPECT_EQ(out.reference[10].stamp, out.odometry[10 + ride].stamp);
  ASSERT_EQ(out.scan_stamps.size(), out.odometry.size());
  for (std::size_t k = 0; k < out.odometry.size(); ++k) {
    const auto scan = out.scans->scan(k);
    ASSERT_TRUE(scan && *scan) << k;
    EXPECT_EQ((*scan)->stamp, out.odometry[k].stamp);
    const Eigen::Vector3f& first = (*scan)->cloud->points.front();
    if (k >= 10 && k < 10 + ride) {
      EXPECT_LT(first.norm(), 2.0F);
    } else {
      const bool is_before = k < 10;
      const auto sample = static_cast<float>(is_before ? k : k - 10 - ride + 15);
      EXPECT_EQ(first, Eigen::Vector3f(is_before ? 100 : 200, sample, 0));
    }
  }
}

TEST(LiftRide, WithoutScansThereIsNothingToRide) {
  Recording blind = recording(0, 20);
  blind.scans = nullptr;
  const auto made = ride_lift(recording(1, 20), blind);
  ASSERT_FALSE(made.has_value());
  EXPECT_NE(made.error().message.find("charlie"), std::string::npos);
}

}  // namespace lift_ride_test
}  // namespace tutti::mission
