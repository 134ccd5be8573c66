// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/geodesy.hpp"

namespace tutti {

/// Standard deviations assumed for a fix whose receiver does not state its uncertainty: east and north, and up.
inline constexpr double kUnknownFix_m = 5.0;
inline constexpr double kUnknownFixUp_m = 10.0;
/// The covariance of these standard deviations: east, north, up; m^2.
[[nodiscard]] Eigen::Matrix3d unknown_fix_covariance();

/// A fix of a satellite receiver: where its antenna was on the earth, and where the antenna is on the robot.
struct PositionFix {
  Timestamp stamp;
  Geodetic antenna;
  Eigen::Matrix3d covariance = unknown_fix_covariance();  ///< East, north, up at the antenna; m^2.
  /// Position of the antenna in the body frame, m.
  Eigen::Vector3d p_body_antenna = Eigen::Vector3d::Zero();
};

/// A position fix as a submap carries it: the antenna's position relative to one of its keyframes, by raw odometry.
struct SubmapFix {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index of the keyframe that is nearest in time.
  Eigen::Vector3d p_keyframe_antenna = Eigen::Vector3d::Zero();  ///< In that keyframe's body frame, m.
  Geodetic antenna;
  Eigen::Matrix3d covariance = unknown_fix_covariance();  ///< East, north, up at the antenna; m^2.
  friend bool operator==(const SubmapFix&, const SubmapFix&) = default;
};

/// Antennas farther than this from the body, or from the keyframe, are refused as an error of the sender.
inline constexpr double kFarthestAntenna_m = 1000.0;
/// Fixes with a larger standard deviation carry no information, and no receiver has a smaller one than
/// kLeastFixSigma_m.
inline constexpr double kLargestFixSigma_m = 1e5;
inline constexpr double kLeastFixSigma_m = 1e-5;

/// Fails unless the antenna is a place on the earth, the covariance is symmetric and positive semidefinite with
/// standard deviations within the limits above, and `p_antenna` is within kFarthestAntenna_m.
[[nodiscard]] Status check_fix(const Geodetic& antenna, const Eigen::Matrix3d& covariance,
                               const Eigen::Vector3d& p_antenna);

/// A covariance that can be inverted, of one that check_fix() accepts: unchanged when no standard deviation is below
/// kLeastTranslation_m, as for odometry, and the correlation matrix is regular beyond the rounding that check_fix()
/// allows; otherwise raised as far as that.
[[nodiscard]] Eigen::Matrix3d invertible_fix_covariance(const Eigen::Matrix3d& covariance);

}  // namespace tutti
