// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/model/imu_sample.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::simulation {

inline constexpr double kGravity_mps2 = 9.80665;

/// Errors of a MEMS sensor, modelled as Furgale, Rehder, Siegwart (2013), "Unified temporal and spatial calibration for
/// multi-sensor systems", do: white noise by its density, a bias that walks. Figures: the ADIS16448 of Burri et al.
/// (2016), "The EuRoC micro aerial vehicle datasets".
struct ImuConfig {
  bool enabled = false;
  double rate_hz = 200.0;
  double gyroscope_noise_density = 1.7e-4;
  double gyroscope_bias_walk = 1.9e-5;
  double gyroscope_start_bias_rad_s = 3e-3;
  double accelerometer_noise_density = 2e-3;
  double accelerometer_bias_walk = 3e-3;
  double accelerometer_start_bias_mps2 = 0.05;
  template <class V>
  void describe(V& v) {
    v.field("enabled", enabled, any(), "Record inertial samples.");
    v.field("rate_hz", rate_hz, between(1.0, 1e4), "Samples per second.");
    v.field("gyroscope_noise_density", gyroscope_noise_density, between(0.0, 1e3), "White noise, rad/s/sqrt(Hz).");
    v.field("gyroscope_bias_walk", gyroscope_bias_walk, between(0.0, 1e3),
            "Random walk of the bias, rad/s^2/sqrt(Hz).");
    v.field("gyroscope_start_bias_rad_s", gyroscope_start_bias_rad_s, between(0.0, 1e3), "First bias, per axis.");
    v.field("accelerometer_noise_density", accelerometer_noise_density, between(0.0, 1e3),
            "White noise, m/s^2/sqrt(Hz).");
    v.field("accelerometer_bias_walk", accelerometer_bias_walk, between(0.0, 1e3),
            "Random walk of the bias, m/s^3/sqrt(Hz).");
    v.field("accelerometer_start_bias_mps2", accelerometer_start_bias_mps2, between(0.0, 1e3), "First bias, per axis.");
  }
};

/// Samples from the first true pose to the last. Between the poses, which it passes through exactly, the motion is a
/// natural cubic spline in position and in the components of the quaternion: twice continuously differentiable, so
/// rates and accelerations have no steps. Gravity points along -z of the truth's frame. Needs two poses; fewer give
/// nothing.
std::vector<ImuSample> simulate_imu(const Trajectory& truth, const ImuConfig& config, Rng rng);

}  // namespace tutti::simulation
