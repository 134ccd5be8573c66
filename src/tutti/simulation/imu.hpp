// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/visual.hpp"
#include "tutti/simulation/flight.hpp"

namespace tutti::simulation {

inline constexpr double kGravity_mps2 = 9.81;  ///< Along world -z.

/// Rate and errors of a simulated IMU.
struct ImuConfig {
  double rate_hz = 200.0;  ///< Samples per second.
  double gyro_noise_density = ImuNoise{}.gyro_noise_density;
  double gyro_random_walk = ImuNoise{}.gyro_random_walk;
  double accelerometer_noise_density = ImuNoise{}.accelerometer_noise_density;
  double accelerometer_random_walk = ImuNoise{}.accelerometer_random_walk;
  double gyro_bias_sigma = 0.01;           ///< rad/s; standard deviation of the bias at the start.
  double accelerometer_bias_sigma = 0.05;  ///< m/s^2; standard deviation of the bias at the start.
  [[nodiscard]] ImuNoise noise() const {
    return {gyro_noise_density, gyro_random_walk, accelerometer_noise_density, accelerometer_random_walk};
  }
};

/// The measurements of an IMU in the body's origin: w + b_g + n_g and R^T (a - g) + b_a + n_a (Forster et al. 2017,
/// eqs. 27, 28), with white noise of density / sqrt(dt) and random-walk biases, from `start` for `duration_s`.
std::vector<ImuSample> simulate_imu(const std::function<Motion(double time_s)>& motion, Timestamp start,
                                    double duration_s, const ImuConfig& config, Rng rng);

}  // namespace tutti::simulation
