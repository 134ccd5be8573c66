// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/odometry.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "tutti/simulation/recordings.hpp"

namespace tutti::simulation {
namespace {

constexpr double kRate_hz = 8.0;

Trajectory walk(std::uint64_t seed, double duration_s) {
  WalkConfig config;
  config.duration_s = duration_s;
  config.rate_hz = kRate_hz;
  return simulate_walk(make_corridor_world({}, Rng(7)), config, {}, std::nullopt, Rng(seed));
}

/// Squared Mahalanobis distance of the error of odometry from pose `from` to `to`, divided by 6: 1 on average when the
/// covariances are honest.
double normalised_error(const Trajectory& truth, const OdometrySimulation& simulated, std::size_t from,
                        std::size_t to) {
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t k = from; k < to; ++k)
    covariance = compound_covariance(simulated.odometry[k].pose.inverse() * simulated.odometry[k + 1].pose, covariance,
                                     simulated.increment_covariance[k]);
  const Vector6d error = local(truth[from].pose.inverse() * truth[to].pose,
                               simulated.odometry[from].pose.inverse() * simulated.odometry[to].pose);
  return error.dot(covariance.ldlt().solve(error)) / 6.0;
}

std::size_t after_distance(const Trajectory& truth, std::size_t from, double metres) {
  double travelled = 0.0;
  while (from + 1 < truth.size() && travelled < metres) {
    travelled += (truth[from + 1].pose.translation - truth[from].pose.translation).norm();
    ++from;
  }
  return from;
}

/// Mean normalised error of stretches of the given length over many runs (0 = single increments).
double mean_normalised_error(const OdometryNoiseConfig& config, double stretch_m, std::uint64_t runs) {
  const Trajectory truth = walk(1, 95.0);  // 50 m and a little, however slowly
  double sum = 0.0;
  double count = 0.0;
  for (std::uint64_t seed = 0; seed < runs; ++seed) {
    const OdometrySimulation simulated = simulate_odometry(truth, config, Rng(seed));
    if (stretch_m <= 0.0) {
      for (std::size_t k = 0; k + 1 < truth.size(); k += 50, count += 1.0)
        sum += normalised_error(truth, simulated, k, k + 1);
    } else {
      sum += normalised_error(truth, simulated, 40, after_distance(truth, 40, stretch_m));
      count += 1.0;
    }
  }
  return sum / count;
}

OdometryNoiseConfig white_noise() {
  OdometryNoiseConfig config;
  config.yaw_bias_deg_per_m = 0.0;
  config.scale_percent = 0.0;
  return config;
}

TEST(SimulateOdometry, WhiteNoiseIsExactlyHonestAtEveryLength) {
  EXPECT_NEAR(mean_normalised_error(white_noise(), 0.0, 100), 1.0, 0.1);
  EXPECT_NEAR(mean_normalised_error(white_noise(), 10.0, 300), 1.0, 0.15);
  EXPECT_NEAR(mean_normalised_error(white_noise(), 50.0, 300), 1.0, 0.15);
}

TEST(SimulateOdometry, SlowErrorsMakeShortStretchesCautiousAndLongOnesHonest) {
  const double increments = mean_normalised_error({}, 0.0, 100);
  EXPECT_LT(increments, 1.05);
  EXPECT_GT(increments, 0.3);
  const double stretches = mean_normalised_error({}, 50.0, 300);
  EXPECT_LT(stretches, 1.2);
  EXPECT_GT(stretches, 0.5);
}

TEST(SimulateOdometry, InflationIsWhatKeepsStrongConstantErrorsHonest) {
  OdometryNoiseConfig config;
  config.yaw_drift_deg_per_m = 0.1;
  config.scale_percent = 1.0;
  config.yaw_bias_deg_per_m = 0.02;
  const double stretches = mean_normalised_error(config, 50.0, 300);
  EXPECT_LT(stretches, 1.3);
  EXPECT_GT(stretches, 0.3);
  // The same errors, were each increment judged alone, would be far outside.
  OdometryNoiseConfig blind = config;
  blind.consistent_length_m = 1e-3;
  EXPECT_GT(mean_normalised_error(blind, 50.0, 100), 2.0 * stretches);
}

TEST(SimulateOdometry, SlipsAreNotInTheCovariance) {
  OdometryNoiseConfig config = white_noise();
  config.slips_per_km = 20.0;
  EXPECT_GT(mean_normalised_error(config, 50.0, 100), 10.0);
}

RC_GTEST_PROP(SimulateOdometry, WithoutNoiseOnlyTheFrameDiffers, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const Trajectory truth = walk(seed, 30.0);
  OdometryNoiseConfig config;
  config.translation_m_per_sqrt_m = config.yaw_deg_per_sqrt_m = config.tilt_deg_per_sqrt_m = 0.0;
  config.floor_m = config.floor_deg = 1e-12;
  config.yaw_bias_deg_per_m = config.scale_percent = 0.0;
  const OdometrySimulation simulated = simulate_odometry(truth, config, Rng(seed));
  RC_ASSERT(simulated.odometry.size() == truth.size());
  RC_ASSERT(simulated.increment_covariance.size() + 1 == truth.size());
  const Pose3 T_odom_reference = simulated.odometry.front().pose * truth.front().pose.inverse();
  for (std::size_t k = 0; k < truth.size(); ++k) {
    RC_ASSERT(simulated.odometry[k].stamp == truth[k].stamp);
    RC_ASSERT(local(T_odom_reference * truth[k].pose, simulated.odometry[k].pose).norm() < 1e-8);
  }
}

RC_GTEST_PROP(SimulateOdometry, CovariancesAreSymmetricAndPositiveDefinite, ()) {
  const Trajectory truth = walk(1, 20.0);
  const auto simulated = simulate_odometry(truth, {}, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  for (const Matrix6d& covariance : simulated.increment_covariance) {
    RC_ASSERT(covariance == covariance.transpose());
    RC_ASSERT(covariance.llt().info() == Eigen::Success);
  }
}

TEST(SimulateOdometry, EmptyAndSinglePose) {
  EXPECT_TRUE(simulate_odometry({}, {}, Rng(1)).odometry.empty());
  const auto one = simulate_odometry({StampedPose{{5}, {}}}, {}, Rng(1));
  EXPECT_EQ(one.odometry.size(), 1U);
  EXPECT_TRUE(one.increment_covariance.empty());
}

TEST(SimulateRecordings, EveryRobotIsItsOwnAndDependsOnlyOnTheSeed) {
  SimulationConfig config;
  config.robots = 3;
  config.walk.duration_s = 20.0;
  const std::vector<Recording> recordings = simulate_recordings(config, {1000}, 9);
  ASSERT_EQ(recordings.size(), 3U);
  EXPECT_EQ(recordings[2].name, "charlie");
  EXPECT_EQ(recordings[2].robot, RobotId{2});
  EXPECT_NE(recordings[0].reference, recordings[1].reference);
  config.robots = 2;
  const std::vector<Recording> fewer = simulate_recordings(config, {1000}, 9);
  for (std::size_t i = 0; i < fewer.size(); ++i) {  // another robot does not change the ones there
    EXPECT_EQ(fewer[i].reference, recordings[i].reference);
    EXPECT_EQ(fewer[i].odometry, recordings[i].odometry);
    EXPECT_EQ(fewer[i].odometry.size(), fewer[i].increment_covariance.size() + 1);
  }
}

}  // namespace
}  // namespace tutti::simulation
