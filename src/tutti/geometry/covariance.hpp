// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Standard deviations of one odometry step that stand for "unknown": a step that is less certain is no information.
inline constexpr double kUnknownTranslation_m = 100.0;
inline constexpr double kUnknownRotation_rad = 3.0;

/// Least standard deviations that robot and server believe of one odometry step, so that constraints can outweigh it.
inline constexpr double kLeastTranslation_m = 1e-4;
inline constexpr double kLeastRotation_rad = 1e-5;

/// Accepts the covariance of a pose (right tangent [m; rad]): finite, symmetric and positive semidefinite, to rounding.
/// A coordinate without variance, like the height in planar odometry, must have no correlations either.
/// ErrorCode::invalid otherwise.
[[nodiscard]] Status check_covariance(const Matrix6d& covariance);

/// The covariance of a pose that errs by these, independently in all directions; standard deviations.
[[nodiscard]] Matrix6d diagonal_covariance(double sigma_m, double sigma_rad);

/// The covariance with its standard deviations cut to `most_m` and `most_rad` and its correlations kept. A pose graph
/// with variances too far apart has no numerical solution, for any robot in it. A covariance within the limits comes
/// back unchanged.
[[nodiscard]] Matrix6d bounded_covariance(const Matrix6d& covariance, double most_m = kUnknownTranslation_m,
                                          double most_rad = kUnknownRotation_rad);

/// A covariance that can be inverted: unchanged when no standard deviation is below kLeastTranslation_m or
/// kLeastRotation_rad and the correlation matrix is regular beyond rounding; otherwise with these two variances added
/// to the diagonal.
[[nodiscard]] Matrix6d invertible_covariance(const Matrix6d& covariance);

}  // namespace tutti
