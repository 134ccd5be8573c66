// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/visual.hpp"

/// Forster, Carlone, Dellaert, Scaramuzza, "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry" (2017).
namespace tutti::estimation {

/// Biases of an IMU, in the body frame.
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();           ///< rad/s
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  ///< m/s^2
};

/// Samples further apart than this are no measurement of what happened between them.
inline constexpr double kMaxImuGap_s = 0.1;

/// What the samples say of the time between two keyframes, eqs. (35) to (38), with covariance, eq. (63), and the
/// derivatives by the biases, eq. (44), at `bias`. Between two samples, rate and acceleration are their mean, and the
/// acceleration acts in the attitude half way; at the ends, samples are interpolated. Only the samples of that time are
/// looked at: increasing stamps that cover it, no gap above kMaxImuGap_s, finite.
Result<ImuPreintegration> preintegrate(std::span<const ImuSample> samples, const Keyframe& from, const Keyframe& to,
                                       const ImuBias& bias, const ImuNoise& noise);

/// The constant gyro bias, rad/s, with which the integrated gyro turns as the odometry does from keyframe to keyframe
/// (least squares over Log(dR(bias)^T R_i_j), integrated anew at every estimate). Steps that the samples do not cover
/// are left out; at least three must remain.
Result<Eigen::Vector3d> estimate_gyro_bias(std::span<const ImuSample> samples, std::span<const Keyframe> keyframes);

}  // namespace tutti::estimation
