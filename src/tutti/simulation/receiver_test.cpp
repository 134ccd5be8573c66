// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/receiver.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::simulation::receiver_test {
namespace {

/// East in the truth's frame at 1 m/s.
Trajectory straight(int seconds) {
  Trajectory out;
  for (int k = 0; k <= seconds; ++k)
    out.push_back({Timestamp{0} + static_cast<double>(k), {Eigen::Quaterniond::Identity(), {1.0 * k, 0, 0}}});
  return out;
}

const PlaceConfig kPlace;

Eigen::Vector3d in_truth(const PositionFix& fix) {
  const Pose3 T_ecef_enu = enu_in_ecef({kPlace.latitude_deg, kPlace.longitude_deg, kPlace.height_m});
  const double yaw = kPlace.yaw_deg * std::acos(-1.0) / 180.0;
  return Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * (T_ecef_enu.inverse() * ecef_of(fix.antenna));
}

TEST(Receiver, SaysWhereTheAntennaIs) {
  const auto fixes =
      simulate_fixes(straight(100), {.sigma_m = 1e-3, .sigma_up_m = 1e-3, .antenna_m = {0.5, 1, 2}}, kPlace, Rng(1));
  ASSERT_EQ(fixes.size(), 101U);
  for (std::size_t k = 0; k < fixes.size(); ++k)
    EXPECT_LT((in_truth(fixes[k]) - Eigen::Vector3d(static_cast<double>(k) + 0.5, 1, 2)).norm(), 0.01);
  EXPECT_EQ(fixes[3].p_body_antenna, Eigen::Vector3d(0.5, 1, 2));
}

TEST(Receiver, ErrsAsConfigured) {
  const Trajectory trajectory = straight(20'000);
  const auto errors = [&](const ReceiverConfig& config) {
    std::vector<Eigen::Vector3d> out;
    for (const PositionFix& fix : simulate_fixes(trajectory, config, kPlace, Rng(1)))
      out.push_back(in_truth(fix) - Eigen::Vector3d(fix.stamp - Timestamp{0}, 0, 0));
    return out;
  };
  for (const double correlation_s : {0.0, 10.0}) {
    const auto noise = errors({.correlation_s = correlation_s});
    double square = 0.0, next = 0.0;
    for (std::size_t k = 0; k + 1 < noise.size(); ++k) {
      square += noise[k].x() * noise[k].x();
      next += noise[k].x() * noise[k + 1].x();
    }
    EXPECT_NEAR(square / static_cast<double>(noise.size()), 1.0, 0.15);
    EXPECT_NEAR(next / square, correlation_s > 0.0 ? std::exp(-0.1) : 0.0, 0.03);
  }
  const auto wrong = errors({.wrong_share = 0.2, .wrong_m = 30.0});
  const auto far = std::ranges::count_if(wrong, [](const auto& e) { return e.norm() > 15.0; });
  EXPECT_NEAR(static_cast<double>(far) / static_cast<double>(wrong.size()), 0.2, 0.02);
  EXPECT_EQ(errors({.outage_s = {100, 200}}).size(), 20'001U - 100U);
}

}  // namespace
}  // namespace tutti::simulation::receiver_test
