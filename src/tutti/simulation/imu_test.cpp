// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/imu.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/corridor_world.hpp"
#include "tutti/simulation/trajectory.hpp"

namespace tutti::simulation {
namespace {

ImuConfig noise_free(double rate_hz = 200.0) {
  return {.rate_hz = rate_hz,
          .gyroscope_noise_density = 0.0,
          .gyroscope_bias_walk = 0.0,
          .gyroscope_start_bias_rad_s = 0.0,
          .accelerometer_noise_density = 0.0,
          .accelerometer_bias_walk = 0.0,
          .accelerometer_start_bias_mps2 = 0.0};
}

Trajectory walk(std::uint64_t seed, double duration_s) {
  WalkConfig config;
  config.duration_s = duration_s;
  config.pauses_per_min = 3.0;
  return simulate_walk(make_corridor_world({}, Rng(7)), config, {1'000'000'000}, std::nullopt, Rng(seed));
}

/// Strapdown integration from `start` by the trapezoidal rule: pose at every sample.
std::vector<Pose3> integrate(const std::vector<ImuSample>& samples, const Pose3& start, Eigen::Vector3d velocity) {
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_mps2);
  std::vector<Pose3> poses{start};
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt = samples[i + 1].stamp - samples[i].stamp;
    const Pose3& last = poses.back();
    const Eigen::Quaterniond rotation =
        (last.rotation * so3_exp(0.5 * dt * (samples[i].gyroscope + samples[i + 1].gyroscope))).normalized();
    const Eigen::Vector3d before = last.rotation * samples[i].accelerometer + gravity;
    const Eigen::Vector3d after = rotation * samples[i + 1].accelerometer + gravity;
    const Eigen::Vector3d position = last.translation + dt * velocity + dt * dt / 6.0 * (2.0 * before + after);
    velocity += 0.5 * dt * (before + after);
    poses.push_back({rotation, position});
  }
  return poses;
}

RC_GTEST_PROP(SimulateImu, IntegratingNoiseFreeSamplesGivesTheTruthBack, ()) {
  const Trajectory truth = walk(*rc::gen::arbitrary<std::uint32_t>(), 30.0);
  const std::vector<ImuSample> samples = simulate_imu(truth, noise_free(), Rng(1));
  RC_ASSERT(samples.size() == 30U * 200U + 1U);
  // The velocity at the start is the only unknown: what takes the robot to its second pose.
  constexpr std::size_t kPerPose = 25;
  const double step_s = truth[1].stamp - truth[0].stamp;
  const auto at_rest = integrate({samples.begin(), samples.begin() + kPerPose + 1}, truth[0].pose, {0, 0, 0});
  const Eigen::Vector3d velocity = (truth[1].pose.translation - at_rest.back().translation) / step_s;
  const std::vector<Pose3> poses = integrate(samples, truth[0].pose, velocity);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Vector6d error = local(truth[k].pose, poses[k * kPerPose]);
    RC_ASSERT(error.tail<3>().norm() < 1e-3);
    RC_ASSERT(error.head<3>().norm() < 0.05 + 1e-3 * std::pow(truth[k].stamp - truth[0].stamp, 2));
  }
}

TEST(SimulateImu, AtRestItMeasuresGravityInTheBodyFrame) {
  const Eigen::Quaterniond rotation = so3_exp({0.1, -0.2, 0.5});
  Trajectory truth;
  for (int k = 0; k < 20; ++k) truth.push_back({Timestamp{} + 0.125 * k, {rotation, {1.0, 2.0, 3.0}}});
  for (const ImuSample& sample : simulate_imu(truth, noise_free(), Rng(1))) {
    EXPECT_LT(sample.gyroscope.norm(), 1e-12);
    EXPECT_LT((rotation * sample.accelerometer - Eigen::Vector3d(0, 0, kGravity_mps2)).norm(), 1e-12);
  }
}

TEST(SimulateImu, OnACircleRateAndCentripetalAccelerationAreTheTextbookOnes) {
  constexpr double kRate = 0.5, kRadius_m = 3.0;
  Trajectory truth;
  for (int k = 0; k < 800; ++k) {  // more than one turn of 4 pi: both signs of the quaternion
    const double angle = kRate * 0.125 * k;
    truth.push_back({Timestamp{} + 0.125 * k,
                     {so3_exp({0, 0, std::remainder(angle, 2.0 * std::numbers::pi)}),
                      {kRadius_m * std::sin(angle), -kRadius_m * std::cos(angle), 0.0}}});
  }
  const auto samples = simulate_imu(truth, noise_free(), Rng(1));
  for (std::size_t i = 400; i + 400 < samples.size(); ++i) {  // the spline's natural ends bend a little
    EXPECT_LT((samples[i].gyroscope - Eigen::Vector3d(0, 0, kRate)).norm(), 1e-5);
    EXPECT_LT((samples[i].accelerometer - Eigen::Vector3d(0, kRate * kRate * kRadius_m, kGravity_mps2)).norm(), 1e-3);
  }
}

TEST(SimulateImu, ReadingsHaveNoSteps) {
  const Trajectory truth = walk(3, 30.0);
  const auto largest_step = [&](double rate_hz) {
    const auto samples = simulate_imu(truth, noise_free(rate_hz), Rng(1));
    double largest = 0.0;
    for (std::size_t i = 0; i + 1 < samples.size(); ++i)
      largest = std::max(largest, (samples[i + 1].accelerometer - samples[i].accelerometer).norm() +
                                      (samples[i + 1].gyroscope - samples[i].gyroscope).norm());
    return largest;
  };
  // Of a continuous signal the largest difference falls with the sampling time; of one with steps it would not.
  EXPECT_LT(largest_step(1600.0), 0.3 * largest_step(400.0));
}

TEST(SimulateImu, NoiseAndBiasHaveTheSizeAskedFor) {
  Trajectory still;
  for (int k = 0; k <= 800; ++k) still.push_back({Timestamp{} + 0.125 * k, {}});
  ImuConfig white = noise_free();
  white.gyroscope_noise_density = 1e-3;
  double sum = 0.0;
  const auto samples = simulate_imu(still, white, Rng(2));
  for (const ImuSample& sample : samples) sum += sample.gyroscope.squaredNorm() / 3.0;
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(samples.size())), 1e-3 * std::sqrt(200.0), 2e-4);

  ImuConfig biased = noise_free(100.0);
  biased.accelerometer_start_bias_mps2 = 0.1;
  biased.accelerometer_bias_walk = 0.02;
  double start = 0.0, walked = 0.0;
  constexpr int kRuns = 80;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    const auto run = simulate_imu({still.begin(), still.begin() + 201}, biased, Rng(seed));  // 25 s
    const Eigen::Vector3d gravity(0, 0, kGravity_mps2);
    start += (run.front().accelerometer - gravity).squaredNorm() / 3.0;
    walked += (run.back().accelerometer - run.front().accelerometer).squaredNorm() / 3.0;
  }
  EXPECT_NEAR(std::sqrt(start / kRuns), 0.1, 0.01);
  EXPECT_NEAR(std::sqrt(walked / kRuns), 0.02 * 5.0, 0.01);
}

TEST(SimulateImu, SameSeedSameBitsAndNothingFromNothing) {
  const Trajectory truth = walk(3, 5.0);
  EXPECT_EQ(simulate_imu(truth, {}, Rng(1)), simulate_imu(truth, {}, Rng(1)));
  EXPECT_NE(simulate_imu(truth, {}, Rng(1)), simulate_imu(truth, {}, Rng(2)));
  EXPECT_TRUE(simulate_imu({}, {}, Rng(1)).empty());
  EXPECT_TRUE(simulate_imu({truth.front()}, {}, Rng(1)).empty());
}

}  // namespace
}  // namespace tutti::simulation
