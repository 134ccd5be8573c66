// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/stereo_check.hpp"

#include <gtest/gtest.h>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::visual {
namespace stereo_check_test {

const CameraModel kModel{CameraKind::pinhole, 752, 480, 458.7, 457.3, 367.2, 248.4, {-0.283, 0.074, 2e-4, 1.8e-5}};
const Camera kFirst{kModel, {}};
const Camera kSecond{kModel, {so3_exp({0.01, -0.02, 0.015}), {0.11, 0.001, -0.002}}};

/// Points 1 to 20 m away, each seen with `sigma_px`, one in ten elsewhere; the calibration has the second camera
/// turned.
std::optional<StereoTurn> turn_between(const Eigen::Vector3d& turn_rad, std::uint64_t seed, int points = 1500,
                                       double sigma_px = 0.3, double focal = 1.0) {
  Rng rng(seed);
  Camera given = kSecond;
  given.model.fx *= focal;
  given.model.fy *= focal;
  given.T_body_camera.rotation = kSecond.T_body_camera.rotation * so3_exp(-turn_rad);
  StereoCheck check(kFirst, given);
  TrackedImage first, second;
  const auto noisy = [&](const Eigen::Vector2d& pixel, double sigma) {
    return Eigen::Vector2d(pixel + Eigen::Vector2d(rng.normal(sigma), rng.normal(sigma))).cast<float>().eval();
  };
  for (std::uint64_t track = 1; track <= static_cast<std::uint64_t>(points); ++track) {
    const Eigen::Vector2d pixel(rng.uniform(0.0, 751.0), rng.uniform(0.0, 479.0));
    const Eigen::Vector3d point = *unproject(kModel, pixel) * std::exp(rng.uniform(0.0, 3.0));
    const auto other = project(kModel, kSecond.T_body_camera.inverse() * point);
    if (!other || !in_image(kModel, *other)) continue;
    first.keypoints.push_back({noisy(pixel, sigma_px), 0.5F, track});
    second.keypoints.push_back({noisy(*other, track % 10 == 0 ? 15.0 : sigma_px), 0.5F, track});
  }
  check.add(first, second);
  return check.turn();
}

TEST(StereoCheck, MeasuresATurnAboutAnyAxis) {
  double chi2 = 0.0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Eigen::Vector3d turn =
        Eigen::Vector3d::Unit(static_cast<int>(seed % 3)) * (seed % 2 == 0 ? 0.9 : -3.0) * kRadPerDeg;
    const auto found = turn_between(turn, seed);
    ASSERT_TRUE(found.has_value());
    EXPECT_TRUE(found->is_wrong && (found->is_turned || seed % 2 == 0)) << seed << ' ' << found->stated_px;
    EXPECT_LT(found->turned_px, 0.5);
    const Eigen::Vector3d error = found->turn_rad - turn;
    EXPECT_LT(error.norm(), 0.1 * kRadPerDeg) << seed << ": " << found->turn_rad.transpose();
    const Eigen::Matrix3d by_points =
        found->covariance - StereoCheck::kStated_rad * StereoCheck::kStated_rad * Eigen::Matrix3d::Identity();
    chi2 += error.dot(by_points.inverse() * error);
  }
  EXPECT_GT(chi2 / 12.0, 0.8);  // 3 is honest
  EXPECT_LT(chi2 / 12.0, 6.0);
}

TEST(StereoCheck, ARightCalibrationIsBelieved) {
  for (std::uint64_t seed = 0; seed < 12; ++seed)
    EXPECT_FALSE(turn_between(Eigen::Vector3d::Constant(seed % 2 == 0 ? 0.0 : 0.05 * kRadPerDeg), seed)->is_wrong)
        << seed;
  EXPECT_FALSE(turn_between({0.0, 0.9 * kRadPerDeg, 0.0}, 1, 100).has_value());
}

TEST(StereoCheck, AWrongFocalLengthIsNoTurn) {
  const auto found = turn_between({0.0, 0.0, 0.0}, 1, 1500, 0.3, 1.03);
  EXPECT_TRUE(found->is_wrong && !found->is_turned) << found->stated_px << ' ' << found->turned_px;
}

}  // namespace stereo_check_test
}  // namespace tutti::visual
