// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/flight.hpp"

#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {
namespace {

/// A value that changes with time, and its first two derivatives.
struct Varying {
  double value = 0.0, rate = 0.0, acceleration = 0.0;
  Varying& operator+=(const Varying& other) {
    value += other.value;
    rate += other.rate;
    acceleration += other.acceleration;
    return *this;
  }
};

/// amplitude sin(omega t + phase)
Varying sine(double amplitude, double omega, double phase, double t) {
  const double s = amplitude * std::sin(omega * t + phase), c = amplitude * std::cos(omega * t + phase);
  return {s, omega * c, -omega * omega * s};
}

}  // namespace

Motion flight_motion(const FlightConfig& config, double t) {
  const double omega = 2.0 * std::numbers::pi / config.round_s, start = config.start_deg * kRadPerDeg;
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  // Multiples of the round that are not whole: no two rounds are the same.
  Varying x = sine(config.semi_length_m, omega, start + kQuarter, t);
  Varying y = sine(config.semi_width_m, omega, start, t);
  Varying z{config.height_m, 0.0, 0.0};
  x += sine(config.wobble_m, 2.3 * omega, 1.0, t);
  y += sine(config.wobble_m, 3.1 * omega, 2.0, t);
  z += sine(config.wobble_m, 4.7 * omega, 0.5, t);

  // The heading on a circle, which an ellipse is not: the difference is one more change of view.
  Varying yaw{omega * t + start + kQuarter - config.look_outwards_deg * kRadPerDeg, omega, 0.0};
  const double tilt = config.tilt_deg * kRadPerDeg;
  yaw += sine(2.0 * tilt, 2.7 * omega, 0.3, t);
  const Varying pitch = sine(tilt, 5.3 * omega, 1.1, t), roll = sine(tilt, 6.1 * omega, 0.2, t);

  Motion out;
  out.T_world_body.translation = {x.value, y.value, z.value};
  out.T_world_body.rotation = Eigen::AngleAxisd(yaw.value, Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(pitch.value, Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(roll.value, Eigen::Vector3d::UnitX());
  out.T_world_body.rotation.normalize();
  out.velocity = {x.rate, y.rate, z.rate};
  out.acceleration = {x.acceleration, y.acceleration, z.acceleration};
  // R = Rz(yaw) Ry(pitch) Rx(roll): each rate turns about its own axis, seen from the body.
  const double sr = std::sin(roll.value), cr = std::cos(roll.value);
  const double sp = std::sin(pitch.value), cp = std::cos(pitch.value);
  out.angular_velocity = {roll.rate - yaw.rate * sp, pitch.rate * cr + yaw.rate * sr * cp,
                          yaw.rate * cr * cp - pitch.rate * sr};
  return out;
}

Trajectory simulate_flight(const FlightConfig& config, Timestamp start) {
  const auto samples = static_cast<std::size_t>(std::floor(config.duration_s * config.rate_hz)) + 1;
  Trajectory truth;
  truth.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double time_s = static_cast<double>(i) / config.rate_hz;
    truth.push_back({start + time_s, flight_motion(config, time_s).T_world_body});
  }
  return truth;
}

}  // namespace tutti::simulation
