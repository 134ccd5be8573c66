// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/imu.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;  // position, quaternion x y z w

struct Knot {
  double time_s = 0.0;  // since the first
  Vector7d value;
  Vector7d curvature = Vector7d::Zero();  // second derivative
};

/// Natural cubic spline: second derivatives by the tridiagonal system of de Boor, "A Practical Guide to Splines"
/// (1978), chapter IV, zero at both ends.
void set_curvatures(std::vector<Knot>& knots) {
  const std::size_t n = knots.size();
  std::vector<double> upper(n, 0.0);  // of the eliminated system; its diagonal is 1
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = knots[i].time_s - knots[i - 1].time_s;
    const double after = knots[i + 1].time_s - knots[i].time_s;
    const Vector7d bend =
        6.0 * ((knots[i + 1].value - knots[i].value) / after - (knots[i].value - knots[i - 1].value) / before);
    const double pivot = 2.0 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    knots[i].curvature = (bend - before * knots[i - 1].curvature) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) knots[i].curvature -= upper[i] * knots[i + 1].curvature;
}

std::vector<Knot> make_knots(const Trajectory& truth) {
  std::vector<Knot> knots;
  Eigen::Vector4d last = truth.front().pose.rotation.coeffs();
  for (const StampedPose& sample : truth) {
    Eigen::Vector4d q = sample.pose.rotation.coeffs();
    if (q.dot(last) < 0.0) q = -q;  // q and -q are one rotation: stay on one side
    last = q;
    Knot knot{.time_s = sample.stamp - truth.front().stamp};
    knot.value << sample.pose.translation, q;
    knots.push_back(knot);
  }
  set_curvatures(knots);
  return knots;
}

/// Rate and specific force in the body frame at a time within [a, b].
ImuSample measure(const Knot& a, const Knot& b, double time_s) {
  const double h = b.time_s - a.time_s;
  const double v = (time_s - a.time_s) / h;
  const double u = 1.0 - v;
  const double h6 = h / 6.0;
  const Vector7d value =
      u * a.value + v * b.value + h * h6 * ((u * u * u - u) * a.curvature + (v * v * v - v) * b.curvature);
  const Vector7d slope =
      (b.value - a.value) / h + h6 * ((3.0 * v * v - 1.0) * b.curvature - (3.0 * u * u - 1.0) * a.curvature);
  const Vector7d curvature = u * a.curvature + v * b.curvature;

  // The components leave the unit sphere between knots: omega = 2 vec(p^-1 p'), whatever the norm of p.
  const Eigen::Quaterniond p(Eigen::Vector4d(value.tail<4>()));
  const Eigen::Quaterniond p_dot(Eigen::Vector4d(slope.tail<4>()));
  ImuSample sample;
  sample.gyroscope = 2.0 * (p.inverse() * p_dot).vec();
  sample.accelerometer = p.normalized().conjugate() * (curvature.head<3>() + Eigen::Vector3d(0.0, 0.0, kGravity_mps2));
  return sample;
}

/// White noise and a walking bias of one three-axis sensor.
class SensorNoise {
 public:
  SensorNoise(double start_bias, double density, double bias_walk, double rate_hz, Rng rng)
      : rng_(std::move(rng)), white_(density * std::sqrt(rate_hz)), walk_(bias_walk / std::sqrt(rate_hz)) {
    bias_ = draw(start_bias);
  }
  Eigen::Vector3d next() {
    const Eigen::Vector3d error = bias_ + draw(white_);
    bias_ += draw(walk_);
    return error;
  }

 private:
  Eigen::Vector3d draw(double sigma) {
    const double x = rng_.normal(sigma);
    const double y = rng_.normal(sigma);
    return {x, y, rng_.normal(sigma)};
  }
  Rng rng_;
  double white_, walk_;
  Eigen::Vector3d bias_;
};

}  // namespace

std::vector<ImuSample> simulate_imu(const Trajectory& truth, const ImuConfig& config, Rng rng) {
  TUTTI_CHECK(config.rate_hz > 0.0, "rate {} Hz", config.rate_hz);
  if (truth.size() < 2) return {};
  const std::vector<Knot> knots = make_knots(truth);
  SensorNoise gyroscope(config.gyroscope_start_bias_rad_s, config.gyroscope_noise_density, config.gyroscope_bias_walk,
                        config.rate_hz, rng.fork("gyroscope"));
  SensorNoise accelerometer(config.accelerometer_start_bias_mps2, config.accelerometer_noise_density,
                            config.accelerometer_bias_walk, config.rate_hz, rng.fork("accelerometer"));
  std::vector<ImuSample> samples;
  std::size_t after = 1;
  for (std::size_t i = 0;; ++i) {
    const double time_s = static_cast<double>(i) / config.rate_hz;
    if (time_s > knots.back().time_s) break;
    while (knots[after].time_s < time_s) ++after;
    ImuSample sample = measure(knots[after - 1], knots[after], time_s);
    sample.stamp = truth.front().stamp + time_s;
    sample.gyroscope += gyroscope.next();
    sample.accelerometer += accelerometer.next();
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace tutti::simulation
