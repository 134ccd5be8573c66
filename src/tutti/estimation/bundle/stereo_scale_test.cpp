// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/stereo_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/estimation/bundle/scene.hpp"

namespace tutti::bundle {
namespace stereo_scale_test {

struct Outcome {
  Refinement refined;
  double rmse_m;
};

Outcome flight(const Pose3& T_second_told, std::uint64_t seed = 5, double max_sigmas = 3.0) {
  SceneOptions options{.points = 120, .pixel_sigma = 0.5, .odometry_sigma_m = 0.01, .cameras = 2};
  options.T_second_told = T_second_told;
  const Scene scene = make_scene(options, seed);
  RefinementConfig config;
  config.stereo.max_sigmas = max_sigmas;
  Refinement refined = refine_map(scene.input, config).value();
  const double rmse_m = position_rmse(refined.keyframes, scene.truth);
  return {std::move(refined), rmse_m};
}

/// Along the baseline, which is the first camera's x: so much longer than 0.2 m.
Pose3 longer_m(double by_m) { return {Eigen::Quaterniond::Identity(), {by_m, 0.0, 0.0}}; }
Pose3 turned_deg(double by_deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(by_deg * kRadPerDeg, Eigen::Vector3d::UnitY())), {0.0, 0.0, 0.0}};
}

TEST(StereoScale, ARightCalibrationIsBelieved) {
  double chi2 = 0.0;
  for (std::uint64_t seed = 0; seed < seeds(4U); ++seed) {
    const Outcome out = flight({}, seed);
    ASSERT_EQ(out.refined.stereo.size(), 1U);
    const StereoScale& scale = out.refined.stereo.front();
    EXPECT_FALSE(scale.is_refused) << scale.ratio << " +- " << scale.sigma;
    EXPECT_LT(scale.sigma, 0.03);
    chi2 += std::pow((scale.ratio - 1.0) / scale.sigma, 2);
  }
  EXPECT_LT(chi2, 13.0);
}

/// The ratio says by how much; the map keeps odometry's scale.
TEST(StereoScale, ABaselineTenPerCentTooLongIsRefused) {
  const Outcome out = flight(longer_m(0.02)), believed = flight(longer_m(0.02), 5, 1e9);
  const StereoScale& scale = out.refined.stereo.front();
  EXPECT_TRUE(scale.is_refused);
  EXPECT_NEAR(scale.ratio, 1.1, 3.0 * scale.sigma);
  EXPECT_LT(out.rmse_m, 0.5 * believed.rmse_m) << out.rmse_m << " m, believed " << believed.rmse_m;
}

TEST(StereoScale, CamerasTurnedAgainstEachOtherAreRefused) {
  const Outcome out = flight(turned_deg(0.9)), believed = flight(turned_deg(0.9), 5, 1e9);
  EXPECT_TRUE(out.refined.stereo.front().is_refused)
      << out.refined.stereo.front().ratio << " +- " << out.refined.stereo.front().sigma;
  EXPECT_LT(out.rmse_m, 0.5 * believed.rmse_m) << out.rmse_m << " m, believed " << believed.rmse_m;
}

TEST(StereoScale, OneCameraHasNone) {
  EXPECT_TRUE(refine_map(make_scene({.points = 60}, 1).input, {}).value().stereo.empty());
}

}  // namespace stereo_scale_test
}  // namespace tutti::bundle
