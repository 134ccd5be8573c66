// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/imu.hpp"

#include <cmath>

namespace tutti::simulation {
namespace {

Eigen::Vector3d draw(double sigma, Rng& rng) {
  Eigen::Vector3d out;
  for (double& value : out) value = rng.normal(sigma);
  return out;
}

}  // namespace

std::vector<ImuSample> simulate_imu(const std::function<Motion(double time_s)>& motion, Timestamp start,
                                    double duration_s, const ImuConfig& config, Rng rng) {
  const double dt = 1.0 / config.rate_hz;
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_mps2);
  Eigen::Vector3d gyro_bias = draw(config.gyro_bias_sigma, rng);
  Eigen::Vector3d accelerometer_bias = draw(config.accelerometer_bias_sigma, rng);
  const auto samples = static_cast<std::size_t>(std::floor(duration_s * config.rate_hz)) + 1;
  std::vector<ImuSample> out;
  out.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double time_s = static_cast<double>(i) * dt;
    const Motion now = motion(time_s);
    out.push_back({.stamp = start + time_s,
                   .gyro = now.angular_velocity + gyro_bias + draw(config.gyro_noise_density / std::sqrt(dt), rng),
                   .accelerometer = now.T_world_body.rotation.conjugate() * (now.acceleration - gravity) +
                                    accelerometer_bias +
                                    draw(config.accelerometer_noise_density / std::sqrt(dt), rng)});
    gyro_bias += draw(config.gyro_random_walk * std::sqrt(dt), rng);
    accelerometer_bias += draw(config.accelerometer_random_walk * std::sqrt(dt), rng);
  }
  return out;
}

}  // namespace tutti::simulation
