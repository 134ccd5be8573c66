// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/image_step.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/perception/visual/textured_room.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/fit/odometry_fit.hpp"

namespace tutti::fit {
namespace image_step_test {

using visual::test::stereo_cameras;

constexpr double kBaselineFactor = 1.04;

/// Looks along a wall at 2 m, round and round in the room.
Pose3 truth_at(double t) {
  const double u = 0.2 * t;
  return {so3_exp({0, 0, u + 0.3 * std::sin(0.7 * t)}), {4.0 + 2.0 * std::cos(u), 3.0 + 1.2 * std::sin(u), 1.4}};
}

/// A robot whose cameras are stated rightly or not.
struct Robot {
  std::vector<visual::test::RoomPoint> room = visual::test::textured_room(900, Rng(1));
  std::shared_ptr<const std::vector<Camera>> stated = std::make_shared<const std::vector<Camera>>(stereo_cameras());
  std::size_t cameras = 2;
  double noise_px = 0.3;

  [[nodiscard]] TrackedImages at(double t) const {
    TrackedImages out{.stamp = Timestamp{} + (100.0 + t), .cameras = stated, .images = {}, .imu = {}, .imu_noise = {}};
    Rng rng = Rng(2).fork(static_cast<std::uint64_t>(1000 * t));
    const auto true_cameras = stereo_cameras();
    for (std::uint32_t c = 0; c < cameras; ++c)
      out.images.push_back(
          visual::test::look(room, true_cameras[c], c, truth_at(t), {.pixel_noise_px = noise_px}, rng));
    return out;
  }
};

TEST(ImageStep, IsTheMotionBetweenTwoTimesWithItsCovariance) {
  const Robot robot;
  double chi2 = 0.0;
  int steps = 0;
  for (double t = 0.0; t < 20.0; t += 1.0, ++steps) {
    const auto step = step_between(robot.at(t), robot.at(t + 0.5));
    ASSERT_TRUE(step) << t;
    const Vector6d error = local(truth_at(t).inverse() * truth_at(t + 0.5), step->T_from_to);
    EXPECT_LT(error.head<3>().norm(), 0.03) << t;
    EXPECT_LT(error.tail<3>().norm(), 0.4 * kRadPerDeg) << t;
    chi2 += squared_distance(error, step->covariance);
  }
  EXPECT_LT(chi2 / steps, 12.0);  // 6 where it is as good as it says
  EXPECT_EQ(step_between(robot.at(1.0), robot.at(1.5))->T_from_to,
            step_between(robot.at(1.0), robot.at(1.5))->T_from_to);
}

TEST(ImageStep, ThereIsNoneOfOneCameraOrOfOtherPlaces) {
  Robot one;
  one.cameras = 1;
  EXPECT_FALSE(step_between(one.at(0.0), one.at(0.5)));
  const Robot two;
  TrackedImages elsewhere = two.at(0.5);
  for (TrackedImage& image : elsewhere.images)
    for (TrackedKeypoint& seen : image.keypoints) seen.track += 1'000'000;
  EXPECT_FALSE(step_between(two.at(0.0), elsewhere));
  TrackedImages wrong = two.at(0.5);  // every track is of another point
  for (TrackedImage& image : wrong.images) {
    const std::size_t n = image.keypoints.size();
    std::vector<TrackedKeypoint> turned = image.keypoints;
    for (std::size_t i = 0; i < n; ++i) turned[i].track = image.keypoints[(i + n / 2) % n].track;
    image.keypoints = turned;
  }
  EXPECT_FALSE(step_between(two.at(0.0), wrong));
}

/// Odometry is right.
OdometryFit fit_of(const Robot& robot) {
  std::vector<ScanStep> steps;
  Trajectory odometry;
  for (double t = -6.0; t < 66.0; t += 0.05) odometry.push_back({Timestamp{} + (100.0 + t), truth_at(t)});
  for (double t = 0.0; t < 60.0; t += 0.5)
    if (const auto step = step_between(robot.at(t), robot.at(t + 0.5))) steps.push_back(*step);
  EXPECT_GT(steps.size(), 80U);
  return fit_odometry(steps, odometry);
}

TEST(ImageStep, ABaselineThatIsStatedTooWideIsAScaleAndARightOneIsNothing) {
  Robot robot;
  for (const Misfit& misfit : fit_of(robot).misfits) ADD_FAILURE() << to_string(misfit);
  robot.stated = std::make_shared<const std::vector<Camera>>(stereo_cameras(kBaselineFactor));
  const auto misfits = fit_of(robot).misfits;
  ASSERT_EQ(misfits.size(), 1U);
  EXPECT_EQ(misfits[0].kind, MisfitKind::scale);
  EXPECT_NEAR(misfits[0].value, kBaselineFactor, 0.008);
}

}  // namespace image_step_test
}  // namespace tutti::fit
