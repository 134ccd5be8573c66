// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Odometry that is less sure than this over one step tells nothing; larger numbers only stand for "unknown".
inline constexpr double kUnknownTranslation_m = 100.0;
inline constexpr double kUnknownRotation_rad = 3.0;

/// Nor is odometry believed to be surer than this over one step, on board or on the server: links must outweigh it.
inline constexpr double kLeastTranslation_m = 1e-4;
inline constexpr double kLeastRotation_rad = 1e-5;

/// Is it a covariance of a pose (right tangent: m, rad)? Finite, symmetric and positive semidefinite, each to rounding;
/// a coordinate without variance, like the height of odometry in the plane, must have no correlations either.
[[nodiscard]] Status check_covariance(const Matrix6d& covariance);

/// The covariance with standard deviations of at most `most_m` and `most_rad`, correlations kept: numbers far apart in
/// one graph leave it without a solution for anybody. Unchanged where all are below.
[[nodiscard]] Matrix6d bounded_covariance(const Matrix6d& covariance, double most_m = kUnknownTranslation_m,
                                          double most_rad = kUnknownRotation_rad);

/// One that has an inverse: the same where the correlations are away from 1 by more than rounding and no standard
/// deviation is below kLeastTranslation_m and kLeastRotation_rad; otherwise with these variances added.
[[nodiscard]] Matrix6d invertible_covariance(const Matrix6d& covariance);

}  // namespace tutti
