// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/steady_drift.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::fit {
namespace steady_drift_test {

constexpr double kDeg = kRadPerDeg;

/// Submaps of 8 m whose registrations err by `sigma_deg`; odometry wanders by 0.1 degrees per root of a metre.
SteadyDrift learnt(double deg_per_m, int submaps, std::uint64_t seed, double sigma_deg = 0.3) {
  constexpr double kLength_m = 8.0;
  Rng rng(seed);
  SteadyDrift out;
  for (int k = 0; k < submaps; ++k) {
    const Pose3 truth{so3_exp({0.01, -0.02, 0.9 * rng.normal(1.0)}), {6.0, 1.0, 0.0}};
    ScanStep far;
    far.covariance *= std::pow(sigma_deg * kDeg, 2);
    far.T_from_to = {truth.rotation * so3_exp({0, 0, rng.normal(sigma_deg * kDeg)}), truth.translation};
    const double wander = rng.normal(0.1 * kDeg * std::sqrt(kLength_m));
    const Pose3 odometry{truth.rotation * so3_exp({0, 0, deg_per_m * kDeg * kLength_m + wander}), truth.translation};
    out.add(far, odometry, kLength_m);
  }
  return out;
}

TEST(SteadyDrift, IsKnownAfterFewSubmapsWithItsSignAndSigma) {
  for (const double drift : {0.3, -0.3, 1.0, 2.0})
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const SteadyDrift three = learnt(drift, 3, seed), many = learnt(drift, 30, seed);
      EXPECT_NEAR(three.to_take_out() / kDeg, drift, 0.15) << seed;
      EXPECT_NEAR(many.to_take_out() / kDeg, drift, 5.0 * many.estimate()->sigma / kDeg) << seed;
      EXPECT_LT(many.estimate()->sigma, 0.03 * kDeg);
    }
}

TEST(SteadyDrift, HonestOdometryIsLeftAlone) {
  for (std::uint64_t seed = 0; seed < 200; ++seed)
    for (const int submaps : {1, 2, 5, 30}) {
      EXPECT_EQ(learnt(0.0, submaps, seed).to_take_out(), 0.0) << seed;
      EXPECT_EQ(learnt(0.05, submaps, seed).to_take_out(), 0.0) << seed;
    }
}

/// A clock that is late turns odometry by degrees here and there, which is no drift.
TEST(SteadyDrift, WhatElseOdometryIsWrongByIsDoubt) {
  SteadyDrift drift;
  ScanStep far;
  far.covariance *= std::pow(0.3 * kDeg, 2);
  const Pose3 odometry{so3_exp({0, 0, 0.5 * kDeg * 8.0}), {8, 0, 0}};
  for (int k = 0; k < 3; ++k) drift.add(far, odometry, 8.0, std::pow(5.0 * kDeg, 2));
  EXPECT_EQ(drift.to_take_out(), 0.0);
}

/// Where it changes from submap to submap it is no drift, however sure each registration is.
TEST(SteadyDrift, ScatterCountsAsDoubt) {
  SteadyDrift scattered;
  for (const double deg_per_m : {0.9, -0.5, 1.1, -0.7, 0.8}) {
    ScanStep far;
    far.covariance *= std::pow(0.3 * kDeg, 2);
    scattered.add(far, {so3_exp({0, 0, deg_per_m * kDeg * 8.0}), {8, 0, 0}}, 8.0);
  }
  EXPECT_EQ(scattered.to_take_out(), 0.0);
  EXPECT_GT(scattered.estimate()->sigma, 0.2 * kDeg);
}

TEST(SteadyDrift, LearnsNothingFromShortPathsNorFromPlacesThatAreNotTheSame) {
  SteadyDrift drift;
  ScanStep far;
  drift.add(far, {so3_exp({0, 0, 0.1}), {}}, 1.0);
  drift.add(far, {so3_exp({0, 0, 2.0}), {8, 0, 0}}, 8.0);
  EXPECT_FALSE(drift.estimate().has_value());
  EXPECT_EQ(drift.to_take_out(), 0.0);
}

TEST(WithoutDrift, TakesOutWhatWasPutIn) {
  const double rad_per_m = 0.5 * kDeg;
  Pose3 truth, odometry, mended;
  for (int k = 0; k < 200; ++k) {
    const Pose3 step{so3_exp({0, 0, 0.05 * std::sin(0.1 * k)}), {0.1, 0, 0}};
    const Eigen::Quaterniond half = so3_exp({0, 0, 0.5 * rad_per_m * 0.1});
    const Pose3 spoilt{half * step.rotation * half, half * step.translation};
    truth = truth * step;
    odometry = odometry * spoilt;
    mended = mended * without_drift(spoilt, 0.1, rad_per_m);
  }
  EXPECT_GT((odometry.translation - truth.translation).norm(), 0.5);
  EXPECT_LT((mended.translation - truth.translation).norm(), 1e-6);
}

}  // namespace steady_drift_test
}  // namespace tutti::fit
