// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/visual.hpp"

/// IMU preintegration after Forster, Carlone, Dellaert, Scaramuzza, "On-Manifold Preintegration for Real-Time
/// Visual-Inertial Odometry", T-RO 2017; equation numbers are of that paper.
namespace tutti::estimation {

/// Biases of an IMU, in the body frame.
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();           ///< rad/s
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  ///< m/s^2
};

/// Longest time between two samples: a longer gap is an error, as nothing measures what happened in it.
inline constexpr double kMaxImuGap_s = 0.1;

/// The relative motion between two keyframes by the samples, eqs. (35) to (38), with its covariance, eq. (63), and its
/// derivatives by the biases, eq. (44), at `bias`. Between two samples the rate and the acceleration are the means of
/// both, and the acceleration acts at the attitude half way; at the keyframes' stamps samples are interpolated. Only
/// `samples` of that time are read: they must cover it, be finite, and have increasing stamps without a gap above
/// kMaxImuGap_s; else ErrorCode::invalid.
Result<ImuPreintegration> preintegrate(std::span<const ImuSample> samples, const Keyframe& from, const Keyframe& to,
                                       const ImuBias& bias, const ImuNoise& noise);

/// The constant gyro bias, rad/s, with which the integrated gyro turns as the odometry does from keyframe to keyframe:
/// least squares over Log(dR(bias)^T R_i_j), integrated anew at every iteration. Steps between keyframes that the
/// samples do not cover are left out; fewer than three remaining ones are ErrorCode::invalid.
Result<Eigen::Vector3d> estimate_gyro_bias(std::span<const ImuSample> samples, std::span<const Keyframe> keyframes);

}  // namespace tutti::estimation
