// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/odometry.hpp"

#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/degrade.hpp"

namespace tutti::simulation {
namespace {

double square(double x) { return x * x; }

/// Errors that stay the same, or nearly so, from one increment to the next.
class SlowErrors {
 public:
  SlowErrors(const OdometryNoiseConfig& config, Rng& rng)
      : config_(config),
        scale_(rng.normal(0.01 * config.scale_percent)),
        yaw_drift_(rng.normal(config.yaw_drift_deg_per_m * kRadPerDeg)),
        yaw_bias_(rng.normal(config.yaw_bias_deg_per_m * kRadPerDeg)) {}

  /// Error of an increment of this translation; moves the bias on.
  Vector6d next(const Eigen::Vector3d& translation, Rng& rng) {
    const double distance = translation.norm();
    Vector6d error = Vector6d::Zero();
    error.head<3>() = scale_ * translation;
    error(5) = (yaw_drift_ + yaw_bias_) * distance;
    const double keep = std::exp(-distance / config_.bias_length_m);  // exact Gauss-Markov transition
    yaw_bias_ = keep * yaw_bias_ + rng.normal(config_.yaw_bias_deg_per_m * kRadPerDeg * std::sqrt(1.0 - square(keep)));
    return error;
  }

 private:
  const OdometryNoiseConfig& config_;
  double scale_;
  double yaw_drift_;  // rad per metre
  double yaw_bias_;   // rad per metre
};

/// Standard deviations of the independent part of an increment's error.
Vector6d white_sigma(const OdometryNoiseConfig& config, double distance) {
  const double translation = std::sqrt(square(config.translation_m_per_sqrt_m) * distance + square(config.floor_m));
  const auto rotation = [&](double per_sqrt_m) {
    return kRadPerDeg * std::sqrt(square(per_sqrt_m) * distance + square(config.floor_deg));
  };
  const double tilt = rotation(config.tilt_deg_per_sqrt_m);
  const double yaw = rotation(config.yaw_deg_per_sqrt_m);
  return (Vector6d() << translation, translation, translation, tilt, tilt, yaw).finished();
}

Matrix6d honest_covariance(const OdometryNoiseConfig& config, const Eigen::Vector3d& translation) {
  const double distance = translation.norm();
  Matrix6d covariance = white_sigma(config, distance).cwiseAbs2().asDiagonal();
  if (distance > 0.0) {
    const double scale_per_m = square(0.01 * config.scale_percent) * config.consistent_length_m;
    covariance.topLeftCorner<3, 3>() += scale_per_m / distance * translation * translation.transpose();
  }
  const double bias_per_m = 2.0 * square(config.yaw_bias_deg_per_m) * config.bias_length_m +
                            square(config.yaw_drift_deg_per_m) * config.consistent_length_m;
  covariance(5, 5) += square(kRadPerDeg) * bias_per_m * distance;
  return covariance;
}

Vector6d draw_slip(const OdometryNoiseConfig& config, double distance, Rng& rng) {
  const bool slips = rng.bernoulli(1.0 - std::exp(-1e-3 * config.slips_per_km * distance));
  const double x = rng.normal(config.slip_m);
  const double y = rng.normal(config.slip_m);
  const double yaw = rng.normal(config.slip_deg * kRadPerDeg);
  if (!slips) return Vector6d::Zero();
  return (Vector6d() << x, y, 0.0, 0.0, 0.0, yaw).finished();
}

}  // namespace

OdometrySimulation simulate_odometry(const Trajectory& truth, const OdometryNoiseConfig& config, Rng rng) {
  OdometrySimulation result;
  if (truth.empty()) return result;
  Rng frame_rng = rng.fork("frame");
  Rng slow_rng = rng.fork("slow");
  Rng white_rng = rng.fork("white");
  Rng slip_rng = rng.fork("slips");
  SlowErrors slow(config, slow_rng);
  result.odometry.reserve(truth.size());
  result.increment_covariance.reserve(truth.size() - 1);
  result.odometry.push_back(
      {truth.front().stamp, random_frame(frame_rng, config.start_tilt_deg, config.start_shift_m)});
  for (std::size_t k = 0; k + 1 < truth.size(); ++k) {
    const Pose3 increment = truth[k].pose.inverse() * truth[k + 1].pose;
    const double distance = increment.translation.norm();
    Vector6d error = white_sigma(config, distance);
    for (double& e : error) e *= white_rng.normal();
    error += slow.next(increment.translation, slow_rng);
    error += draw_slip(config, distance, slip_rng);
    // The translation part of the error is meant in the frame of the increment's start; the tangent is its end's.
    error.head<3>() = increment.rotation.conjugate() * error.head<3>();
    result.odometry.push_back({truth[k + 1].stamp, result.odometry.back().pose * retract(increment, error)});

    Matrix6d covariance = honest_covariance(config, increment.translation);
    const Eigen::Matrix3d R = increment.rotation.toRotationMatrix();
    covariance.topLeftCorner<3, 3>() = (R.transpose() * covariance.topLeftCorner<3, 3>() * R).eval();
    result.increment_covariance.push_back(0.5 * (covariance + covariance.transpose()));
  }
  return result;
}

}  // namespace tutti::simulation
