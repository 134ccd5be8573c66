// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/refine_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/estimation/bundle/scene.hpp"
#include "support/sanitized.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::bundle {
namespace refine_map_test {

using namespace test;
using estimation::Termination;

double start_rmse(const Scene& scene) {
  std::vector<BundleKeyframe> start;
  for (const auto& posed : scene.input.submaps)
    for (std::size_t k = 0; k < posed.T_world_body.size(); ++k)
      start.push_back({{RobotId{0}, posed.submap->keyframes[k].index}, posed.T_world_body[k]});
  return position_rmse(start, scene.truth);
}

TEST(RefineMap, ExactWithoutNoise) {
  const Scene scene = make_scene({.pixel_sigma = 1e-4, .odometry_sigma_m = 1e-7, .odometry_sigma_rad = 1e-7}, 1);
  auto config = exact_config();
  const auto refined = refine_map(scene.input, config).value();
  EXPECT_EQ(refined.adjustment.termination, Termination::converged);
  EXPECT_GT(start_rmse(scene), 0.02);
  EXPECT_LT(position_rmse(refined.keyframes, scene.truth), 1e-5);
  ASSERT_EQ(refined.factors.size(), scene.truth.size() - 1);
  for (const auto& factor : refined.factors) {
    EXPECT_EQ(factor.to.index, factor.from.index + 1);
    EXPECT_TRUE(pose_near(factor.measurement.T_a_b,
                          scene.truth[factor.from.index].inverse() * scene.truth[factor.to.index], 1e-5));
  }
}

/// Squared error of the factors over their covariance, on average: 6 when the covariance is honest.
double mean_nees(const Scene& scene, const RefinedMap& refined) {
  double sum = 0.0;
  for (const auto& [from, to, measurement] : refined.factors) {
    const Vector6d error = local(measurement.T_a_b, scene.truth[from.index].inverse() * scene.truth[to.index]);
    sum += squared_distance(error, measurement.covariance);
  }
  return sum / static_cast<double>(refined.factors.size());
}

double average_nees(const SceneOptions& options, const RefinementConfig& config, int runs) {
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    const Scene scene = make_scene(options, 100 + static_cast<std::uint64_t>(run));
    sum += mean_nees(scene, refine_map(scene.input, config).value());
  }
  return sum / runs;
}

TEST(RefineMap, CovarianceIsConsistent) {
  TUTTI_STATISTIC();
  EXPECT_NEAR(average_nees({.points = 120}, exact_config(), 12), 6.0, 0.7);
}

/// The steps of a map by one camera are all too long or all too short together, as its odometry is.
TEST(RefineMap, CovarianceKnowsThatOdometryErrsInScale) {
  TUTTI_STATISTIC();
  const SceneOptions options{.points = 120, .odometry_sigma_m = 0.005, .odometry_scale_sigma = 0.02};
  auto config = exact_config();
  EXPECT_GT(average_nees(options, config, 20), 20.0);
  config.bundle.odometry_scale_sigma = 0.02;
  EXPECT_NEAR(average_nees(options, config, 20), 6.0, 1.5);
}

TEST(RefineMap, CovarianceIsConsistentWithImu) {
  TUTTI_STATISTIC();
  auto config = exact_config();
  config.merge.use_imu = true;
  config.bundle.gyro_random_walk = 1e-5;  // the scene's biases stand still
  config.bundle.accelerometer_random_walk = 1e-4;
  EXPECT_NEAR(average_nees({.keyframes = 15, .points = 60, .imu = true}, config, 12), 6.0, 0.9);
}

/// Pixels that are worse than their sigma are noticed.
TEST(RefineMap, ViewsWeighWhatTheyTurnOutToBe) {
  TUTTI_STATISTIC();
  Scene scene = make_scene({.points = 120, .pixel_sigma = 2.0}, 3);
  for (auto& posed : scene.input.submaps) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    auto visual = std::make_shared<VisualPayload>(*submap->visual);
    for (auto& frame : visual->frames)
      for (auto& view : frame.observations) view.sigma_px = 0.5F;
    submap->visual = visual;
    posed.submap = submap;
  }
  EXPECT_LT(mean_nees(scene, refine_map(scene.input, exact_config()).value()), 30.0);  // 96 if they were believed
}

TEST(RefineMap, BetterThanItStarted) {
  const Scene scene = make_scene({}, 2);
  const auto refined = refine_map(scene.input, {}).value();
  EXPECT_LT(position_rmse(refined.keyframes, scene.truth), 0.5 * start_rmse(scene));
  EXPECT_LT(refined.residuals_after.front().median_px, 2.0);
  EXPECT_GT(refined.residuals_before.front().observations, 100U);
  EXPECT_TRUE(pose_near(refined.keyframes.front().T_world_body, scene.input.submaps.front().T_world_body.front(), 0.0));
}

TEST(RefineMap, ImuHelpsWhereNothingClosesALoop) {
  SceneOptions options{.keyframes = 15, .points = 25, .odometry_sigma_m = 0.1, .odometry_sigma_rad = 0.02, .imu = true};
  double with = 0.0, without = 0.0;
  for (std::uint64_t seed = 0; seed < seeds(4U); ++seed) {
    Scene scene = make_scene(options, seed);
    scene.input.matches.clear();
    auto config = exact_config();
    without += position_rmse(refine_map(scene.input, config).value().keyframes, scene.truth);
    config.merge.use_imu = true;
    with += position_rmse(refine_map(scene.input, config).value().keyframes, scene.truth);
  }
  EXPECT_LT(with, 0.7 * without);
}

TEST(RefineMap, WrongMatchesAndPixelsDoNoHarm) {
  Scene scene = make_scene({}, 4);
  Rng rng(1);
  for (auto& posed : scene.input.submaps) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    auto visual = std::make_shared<VisualPayload>(*submap->visual);
    for (auto& frame : visual->frames)
      for (auto& view : frame.observations)
        if (rng.bernoulli(0.1)) view.pixel += test::random_vector(rng, 30.0).head<2>().cast<float>();
    submap->visual = visual;
    posed.submap = submap;
  }
  for (auto& match : scene.input.matches)
    if (rng.bernoulli(0.1)) match.other.index = 0;
  const auto refined = refine_map(scene.input, {}).value();
  EXPECT_GT(refined.merge.views_contradicting, 50U);
  EXPECT_LT(position_rmse(refined.keyframes, scene.truth), 0.6 * start_rmse(scene));
}

TEST(RefineMap, OdometryStaysWhereNothingIsSeen) {
  Scene scene = make_scene({}, 5);
  scene.input.matches.clear();
  for (auto& posed : scene.input.submaps) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    submap->visual = nullptr;
    posed.submap = submap;
  }
  const auto refined = refine_map(scene.input, {}).value();
  ASSERT_EQ(refined.factors.size(), scene.truth.size() - 1);
  EXPECT_EQ(refined.factors.front().measurement, scene.input.submaps.front().submap->odometry.front());
}

/// Two robots that never saw the same: each keeps its own gauge.
TEST(RefineMap, UnconnectedMapsKeepTheirPlaces) {
  Scene scene = make_scene({.keyframes = 15}, 6);
  scene.input.matches.clear();
  auto second = make_scene({.keyframes = 15}, 7).input.submaps;
  for (auto& posed : second) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    submap->id.chain = RobotId{1};
    posed.submap = submap;
    for (auto& T : posed.T_world_body) T.translation.x() += 100.0;
    scene.input.submaps.push_back(posed);
  }
  const auto refined = refine_map(scene.input, {}).value();
  EXPECT_EQ(refined.adjustment.components, 2);
  EXPECT_EQ(refined.factors.size(), 28U);
  for (const auto& keyframe : refined.keyframes)
    if (keyframe.id.index == 0) {
      const auto& submap = scene.input.submaps[keyframe.id.chain.robot.value == 0 ? 0 : 2];
      EXPECT_TRUE(pose_near(keyframe.T_world_body, submap.T_world_body.front(), 0.0));
    }
}

/// The scene with its true poses where they are fixed.
Scene partly_held(const SceneOptions& options, std::uint64_t seed) {
  Scene scene = make_scene(options, seed);
  for (auto& posed : scene.input.submaps) {
    posed.is_constant = posed.submap->id.index != 1;
    for (std::size_t k = 0; posed.is_constant && k < posed.T_world_body.size(); ++k)
      posed.T_world_body[k] = scene.truth[posed.submap->keyframes[k].index];
  }
  return scene;
}

TEST(RefineMap, WhatIsConstantStaysAndHoldsTheOthers) {
  const Scene scene = partly_held({}, 2);
  const auto refined = refine_map(scene.input, {}).value();
  const auto& submaps = scene.input.submaps;
  ASSERT_EQ(refined.keyframes.size(), scene.truth.size());
  double moved = 0.0, off = 0.0;
  for (const auto& keyframe : refined.keyframes) {
    const Pose3& truth = scene.truth[keyframe.id.index];
    const bool is_free = keyframe.id.index > submaps[1].submap->keyframes.front().index &&
                         keyframe.id.index < submaps[1].submap->keyframes.back().index;
    EXPECT_EQ(keyframe.is_constant, !is_free);  // shared ones too
    if (!is_free) {
      EXPECT_EQ(keyframe.T_world_body, truth);
      continue;
    }
    const Pose3& start = submaps[1].T_world_body[keyframe.id.index - submaps[1].submap->keyframes.front().index];
    moved = std::max(moved, local(start, keyframe.T_world_body).norm());
    off = std::max(off, local(truth, keyframe.T_world_body).head<3>().norm());
  }
  EXPECT_GT(moved, 0.02);
  EXPECT_LT(off, 0.02);  // odometry: 0.02 a step
  ASSERT_EQ(refined.factors.size(), submaps[1].submap->odometry.size());
  EXPECT_EQ(refined.factors.front().from.index, submaps[1].submap->keyframes.front().index);
  EXPECT_GT(refined.rms_before_px, refined.rms_after_px);
}

TEST(RefineMap, CovarianceOfWhatIsFreeIsConsistent) {
  TUTTI_STATISTIC();
  double sum = 0.0;
  const int runs = 30;
  for (int run = 0; run < runs; ++run) {
    const Scene scene = partly_held({.points = 120}, 300 + static_cast<std::uint64_t>(run));
    sum += mean_nees(scene, refine_map(scene.input, exact_config()).value());
  }
  EXPECT_NEAR(sum / runs, 6.0, 0.9);
}

TEST(RefineMap, WithEverythingConstantNothingHappens) {
  Scene scene = make_scene({.keyframes = 15}, 2);
  for (auto& posed : scene.input.submaps) posed.is_constant = true;
  const auto refined = refine_map(scene.input, {}).value();
  EXPECT_TRUE(refined.factors.empty());
  EXPECT_TRUE(refined.landmarks.empty());
}

}  // namespace refine_map_test
}  // namespace tutti::bundle
