// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/imu.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {
namespace imu_test {

const Eigen::Vector3d kGravity(0.0, 0.0, -kGravity_mps2);

/// Dead reckoning, trapezoidal rule, from the true pose and velocity at the start.
Pose3 integrate(const std::vector<ImuSample>& samples, const Motion& start) {
  Pose3 T = start.T_world_body;
  Eigen::Vector3d velocity = start.velocity;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt = samples[i + 1].stamp - samples[i].stamp;
    const Eigen::Quaterniond next = T.rotation * so3_exp(0.5 * dt * (samples[i].gyro + samples[i + 1].gyro));
    const Eigen::Vector3d acceleration =
        0.5 * (T.rotation * samples[i].accelerometer + next * samples[i + 1].accelerometer) + kGravity;
    T.translation += dt * velocity + 0.5 * dt * dt * acceleration;
    velocity += dt * acceleration;
    T.rotation = next.normalized();
  }
  return T;
}

ImuConfig perfect() { return {200.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}; }

const auto kMotion = [](double time_s) { return flight_motion({}, time_s); };

TEST(SimulatedImu, IntegrationGivesBackTheTrajectory) {
  const auto samples = simulate_imu(kMotion, Timestamp{1000}, 20.0, perfect(), Rng(1));
  ASSERT_EQ(samples.size(), 4001U);
  EXPECT_EQ(samples.front().stamp, Timestamp{1000});
  const Pose3 error = flight_motion({}, 20.0).T_world_body.inverse() * integrate(samples, flight_motion({}, 0.0));
  EXPECT_LT(error.translation.norm(), 0.005);
  EXPECT_LT(rotation_angle(error), 1e-4);
}

TEST(SimulatedImu, AtRestItFeelsItsWeight) {
  const auto still = [](double) { return Motion{}; };
  const ImuSample sample = simulate_imu(still, Timestamp{0}, 0.0, perfect(), Rng(1)).at(0);
  EXPECT_EQ(sample.gyro, Eigen::Vector3d::Zero());
  EXPECT_EQ(sample.accelerometer, -kGravity);
}

TEST(SimulatedImu, NoiseAndBiasesAreAsAsked) {
  const auto still = [](double) { return Motion{}; };
  ImuConfig config = perfect();
  config.gyro_noise_density = 1e-3;
  config.accelerometer_random_walk = 1e-2;
  const double duration_s = 100.0;
  double noise = 0.0, walked = 0.0;
  constexpr int kRuns = 20;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const auto samples = simulate_imu(still, Timestamp{0}, duration_s, config, Rng(run));
    for (const ImuSample& it : samples) noise += it.gyro.squaredNorm() / (3.0 * static_cast<double>(samples.size()));
    walked += (samples.back().accelerometer - samples.front().accelerometer).squaredNorm() / 3.0;
  }
  EXPECT_NEAR(std::sqrt(noise / kRuns), 1e-3 * std::sqrt(200.0), 2e-4);
  EXPECT_NEAR(std::sqrt(walked / kRuns), 1e-2 * std::sqrt(duration_s), 0.025);

  config = perfect();
  config.gyro_bias_sigma = 0.02;
  const auto biased = simulate_imu(still, Timestamp{0}, 1.0, config, Rng(3));
  EXPECT_NE(biased.front().gyro, Eigen::Vector3d::Zero());
  EXPECT_EQ(biased.front().gyro, biased.back().gyro);
  EXPECT_EQ(simulate_imu(still, Timestamp{0}, 1.0, config, Rng(3)), biased);
}

}  // namespace imu_test
}  // namespace tutti::simulation
