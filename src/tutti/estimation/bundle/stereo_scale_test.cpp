// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/stereo_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/estimation/bundle/scene.hpp"

namespace tutti::bundle {
namespace stereo_scale_test {

struct Outcome {
  RefinedMap refined;
  double rmse_m;
};

Outcome flight(const Pose3& T_second_given, std::uint64_t seed = 5, double max_sigmas = 3.0,
               const std::string& contradicted = "one_camera") {
  SceneOptions options{.points = 120, .pixel_sigma = 0.5, .odometry_sigma_m = 0.01, .cameras = 2};
  options.T_second_given = T_second_given;
  const Scene scene = make_scene(options, seed);
  RefinementConfig config;
  config.stereo.max_sigmas = max_sigmas;
  config.stereo.contradicted = contradicted;
  RefinedMap refined = refine_map(scene.input, config).value();
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

/// The ratio shows by how much; the map keeps odometry's scale.
TEST(StereoScale, ABaselineTenPerCentTooLongIsRefused) {
  const Outcome out = flight(longer_m(0.02)), believed = flight(longer_m(0.02), 5, 1e9);
  const StereoScale& scale = out.refined.stereo.front();
  EXPECT_TRUE(scale.is_refused);
  EXPECT_NEAR(scale.ratio, 1.1, 3.0 * scale.sigma);
  EXPECT_LT(out.rmse_m, 0.5 * believed.rmse_m) << out.rmse_m << " m, believed " << believed.rmse_m;
}

/// By as much as odometry measures, which has errors of its own; in one scale all along, as two cameras see it.
TEST(StereoScale, ABaselineIsCorrectedWhereThatIsAskedFor) {
  double corrected_m = 0.0, one_camera_m = 0.0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Outcome out = flight(longer_m(0.02), seed, 3.0, "correct");
    const StereoScale& scale = out.refined.stereo.front();
    EXPECT_TRUE(scale.is_corrected && !scale.is_refused);
    corrected_m += out.rmse_m;
    one_camera_m += flight(longer_m(0.02), seed).rmse_m;
    const RelativeFactor& step = out.refined.factors.at(5);
    const Eigen::Vector3d t = step.measurement.T_a_b.rotation.conjugate() * step.measurement.T_a_b.translation;
    const Eigen::Vector3d ahead = t.normalized();
    EXPECT_GE(ahead.dot(step.measurement.covariance.topLeftCorner<3, 3>() * ahead),
              std::pow(scale.sigma / scale.ratio * t.norm(), 2));
  }
  EXPECT_LT(corrected_m, one_camera_m);
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
