// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/imu_preintegration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace {

using Matrix96d = Eigen::Matrix<double, 9, 6>;

/// One step of dt seconds with constant rate and acceleration (bias already taken off).
void integrate(const Eigen::Vector3d& rate, const Eigen::Vector3d& acceleration, double dt, const ImuNoise& noise,
               ImuPreintegration& sum) {
  const Eigen::Matrix3d half = so3_exp(0.5 * dt * rate).toRotationMatrix();
  const Eigen::Quaterniond turn = so3_exp(dt * rate);
  const Eigen::Matrix3d R_half = sum.delta_rotation.toRotationMatrix() * half;
  const Eigen::Vector3d a = R_half * acceleration;
  // How the error of the sums moves on (A), and what errors of rate and acceleration add (B); eq. (62), half way.
  const Eigen::Matrix3d d_a_d_half = -R_half * skew(acceleration);
  const Eigen::Matrix3d d_a_d_rotation = d_a_d_half * half.transpose();
  const Eigen::Matrix3d d_a_d_rate = d_a_d_half * so3_right_jacobian(0.5 * dt * rate) * (0.5 * dt);
  Matrix9d A = Matrix9d::Identity();
  A.block<3, 3>(0, 0) = turn.toRotationMatrix().transpose();
  A.block<3, 3>(3, 0) = d_a_d_rotation * dt;
  A.block<3, 3>(6, 0) = d_a_d_rotation * (0.5 * dt * dt);
  A.block<3, 3>(6, 3) = Eigen::Matrix3d::Identity() * dt;
  Matrix96d B = Matrix96d::Zero();
  B.block<3, 3>(0, 0) = so3_right_jacobian(dt * rate) * dt;
  B.block<3, 3>(3, 0) = d_a_d_rate * dt;
  B.block<3, 3>(6, 0) = d_a_d_rate * (0.5 * dt * dt);
  B.block<3, 3>(3, 3) = R_half * dt;
  B.block<3, 3>(6, 3) = R_half * (0.5 * dt * dt);

  Vector6d variance;  // of the mean over dt of a white noise of that density
  variance << Eigen::Vector3d::Constant(noise.gyro_noise_density * noise.gyro_noise_density / dt),
      Eigen::Vector3d::Constant(noise.accelerometer_noise_density * noise.accelerometer_noise_density / dt);
  sum.covariance = A * sum.covariance * A.transpose() + B * variance.asDiagonal() * B.transpose();  // eq. (63)
  sum.d_bias = A * sum.d_bias - B;
  sum.delta_position += sum.delta_velocity * dt + a * (0.5 * dt * dt);
  sum.delta_velocity += a * dt;
  sum.delta_rotation = (sum.delta_rotation * turn).normalized();
  sum.duration_s += dt;
}

ImuSample at(const ImuSample& before, const ImuSample& after, Timestamp stamp) {
  const double alpha = (stamp - before.stamp) / (after.stamp - before.stamp);
  return {stamp, (1.0 - alpha) * before.gyro + alpha * after.gyro,
          (1.0 - alpha) * before.accelerometer + alpha * after.accelerometer};
}

}  // namespace

Result<ImuPreintegration> preintegrate(std::span<const ImuSample> samples, const Keyframe& from, const Keyframe& to,
                                       const ImuBias& bias, const ImuNoise& noise) {
  if (!(from.stamp < to.stamp))
    return fail(ErrorCode::invalid, "IMU from keyframe {} to {}: stamps do not increase", from.index, to.index);
  const auto later = [](Timestamp stamp, const ImuSample& sample) { return stamp < sample.stamp; };
  auto next = std::upper_bound(samples.begin(), samples.end(), from.stamp, later);
  if (next == samples.begin() || samples.empty() || samples.back().stamp < to.stamp)
    return fail(ErrorCode::invalid, "IMU from keyframe {} to {}: the samples do not cover it", from.index, to.index);

  ImuPreintegration sum{.from_keyframe = from.index, .gyro_bias = bias.gyro, .accelerometer_bias = bias.accelerometer};
  ImuSample last = *(next - 1);
  for (bool first = true; last.stamp < to.stamp; ++next, first = false) {
    const double gap_s = next->stamp - (next - 1)->stamp;
    if (gap_s <= 0.0 || gap_s > kMaxImuGap_s || !next->gyro.allFinite() || !next->accelerometer.allFinite())
      return fail(ErrorCode::invalid, "IMU sample at {} ns, {} s after the one before: expected finite, at most {} s",
                  next->stamp.ns, gap_s, kMaxImuGap_s);
    if (first) last = at(last, *next, from.stamp);
    const ImuSample end = next->stamp < to.stamp ? *next : at(*(next - 1), *next, to.stamp);
    const double dt = end.stamp - last.stamp;
    if (dt > 0.0)
      integrate(0.5 * (last.gyro + end.gyro) - bias.gyro,
                0.5 * (last.accelerometer + end.accelerometer) - bias.accelerometer, dt, noise, sum);
    last = end;
  }
  if (!sum.covariance.allFinite() || !sum.delta_position.allFinite())
    return fail(ErrorCode::invalid, "IMU from keyframe {} to {}: not finite", from.index, to.index);
  return sum;
}

Result<Eigen::Vector3d> estimate_gyro_bias(std::span<const ImuSample> samples, std::span<const Keyframe> keyframes) {
  constexpr int kIterations = 4;  // a bias of 0.08 rad/s is there to 1e-9 after three
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    int steps = 0;
    for (std::size_t k = 0; k + 1 < keyframes.size(); ++k) {
      const auto& from = keyframes[k];
      const auto& to = keyframes[k + 1];
      const auto imu = preintegrate(samples, from, to, {.gyro = bias}, {});
      if (!imu) continue;
      const Eigen::Quaterniond turn = from.T_odom_body.rotation.conjugate() * to.T_odom_body.rotation;
      const Eigen::Vector3d r = so3_log(imu->delta_rotation.conjugate() * turn);
      const Eigen::Matrix3d J = imu->d_bias.topLeftCorner<3, 3>();  // r(bias + d) = r - J d to first order
      H += J.transpose() * J;
      b += J.transpose() * r;
      ++steps;
    }
    if (steps < 3) return fail(ErrorCode::invalid, "gyro bias: {} steps with IMU and odometry, expected 3", steps);
    bias += H.ldlt().solve(b);
  }
  if (!bias.allFinite()) return fail(ErrorCode::invalid, "gyro bias: not finite, as the odometry");
  return bias;
}

}  // namespace tutti::estimation
