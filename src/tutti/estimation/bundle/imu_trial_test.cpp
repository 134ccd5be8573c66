// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/imu_trial.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/estimation/bundle/scene.hpp"
#include "tutti/base/random.hpp"

namespace tutti::bundle {
namespace imu_trial_test {

RefinementConfig with_imu() {
  RefinementConfig config;
  config.merge.use_imu = true;
  return config;
}

/// Refines a flight of so many keyframes in a room, with its IMU.
RefinedMap refined(int keyframes, const RefinementConfig& config, double segment = 1.0) {
  Scene scene = make_scene({.keyframes = keyframes, .points = 60, .imu = true}, 3);
  for (PosedSubmap& posed : scene.input.submaps) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    auto visual = std::make_shared<VisualPayload>(*submap->visual);
    for (ImuPreintegration& imu : visual->imu) {
      imu.delta_position *= segment;
      imu.delta_velocity *= segment;
    }
    submap->visual = visual;
    posed.submap = submap;
  }
  return refine_map(scene.input, config).value();
}

TEST(ImuTrial, AFlightLongEnoughIsBelieved) {
  const RefinedMap out = refined(15, with_imu());
  ASSERT_EQ(out.imu.size(), 1U);
  EXPECT_EQ(out.imu[0].factors, 14U);
  EXPECT_FALSE(out.imu[0].is_held_back);
  EXPECT_LT(out.imu[0].bias_sigma_mps2, 0.05);
  EXPECT_LT(std::abs(out.imu[0].scale - 1.0), 3.0 * out.imu[0].scale_sigma);
}

/// Poses and motion are blocks of a solver that sorts them by their addresses, and other threads' memory is what
/// decides where a vector of them begins.
TEST(ImuTrial, TheLastDigitsAreTheSameWhereverTheMemoryIs) {
  const RefinedMap expected = refined(6, with_imu());
  Rng rng(1);
  std::vector<std::vector<char>> taken;
  for (int trial = 0; trial < 5; ++trial) {
    for (int i = 0; i < 2000; ++i) taken.emplace_back(1 + rng.index(1000));
    for (int i = 0; i < 1000; ++i) std::vector<char>().swap(taken[rng.index(taken.size())]);
    const RefinedMap out = refined(6, with_imu());
    ASSERT_EQ(out.factors.size(), expected.factors.size());
    for (std::size_t i = 0; i < out.factors.size(); ++i)
      ASSERT_EQ(out.factors[i].measurement.T_a_b, expected.factors[i].measurement.T_a_b) << trial;
  }
}

/// Three seconds do not distinguish the bias from gravity: the map is what it is without an IMU.
TEST(ImuTrial, AShortFlightIsAsWithoutAnImu) {
  const RefinedMap out = refined(3, with_imu()), without = refined(3, {});
  ASSERT_EQ(out.imu.size(), 1U);
  EXPECT_TRUE(out.imu[0].is_held_back);
  EXPECT_GT(out.imu[0].bias_sigma_mps2, 0.05);
  ASSERT_EQ(out.factors.size(), without.factors.size());
  for (std::size_t i = 0; i < out.factors.size(); ++i) {
    EXPECT_EQ(out.factors[i].measurement.T_a_b, without.factors[i].measurement.T_a_b);
    EXPECT_EQ(out.factors[i].measurement.covariance, without.factors[i].measurement.covariance);
  }
}

/// An accelerometer in other units, or of another body.
TEST(ImuTrial, OneThatContradictsTheTrajectoryIsLeftOut) {
  const RefinedMap out = refined(15, with_imu(), 1.4);
  ASSERT_EQ(out.imu.size(), 1U);
  EXPECT_TRUE(out.imu[0].is_held_back);
  EXPECT_GT(std::abs(out.imu[0].scale - 1.0), 3.0 * out.imu[0].scale_sigma);
}

TEST(ImuTrial, WithoutAnImuThereIsNothingToTry) { EXPECT_TRUE(refined(5, {}).imu.empty()); }

}  // namespace imu_trial_test
}  // namespace tutti::bundle
