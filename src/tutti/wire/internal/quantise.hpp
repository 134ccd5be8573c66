// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tutti/geometry/pose3.hpp"
#include "tutti/wire/limits.hpp"

/// Poses and covariances as small integers. quantise(dequantise(code)) == code for every code that quantise makes, so
/// values change once, not at every hop (covariances at the limit of 1e-3 named below: twice).
namespace tutti::wire {

using PoseCode = std::array<std::int64_t, 6>;
using CovarianceCode = std::array<std::int64_t, 21>;

struct PoseSteps {
  double translation_m = 0.0;
  double rotation_rad = 0.0;
  double largest_m = kMaxCoordinate_m;  ///< The translation's, per axis.
};
/// Errors: 0.87e-5 m, 1e-6 rad.
inline constexpr PoseSteps kKeyframePoseSteps{1e-5, 5e-7};
/// For the motion from one pose to another, each within kMaxCoordinate_m per axis. Errors: 0.44e-3 m, 1e-4 rad.
inline constexpr PoseSteps kProxyPoseSteps{5e-4, 5e-5, 4.0 * kMaxCoordinate_m};  // 2 sqrt(3), with room for rounding

/// Translation and rotation vector, rounded; the rotation vector stays shorter than pi, so that it is unique.
PoseCode quantise(const Pose3& T, const PoseSteps& steps);
/// Nothing when a coordinate exceeds the steps' largest or the rotation vector pi.
std::optional<Pose3> dequantise(const PoseCode& code, const PoseSteps& steps);

/// Steps of the logarithm of the Cholesky factor's diagonal, and of its rows divided by their diagonal. With both s,
/// (1 - e) C <= C' <= (1 + e) C in every direction, e ~ 4.6 s. Measured with the proxy's, which are not equal, on the
/// simulated tunnels: 3.3 % root mean square over directions, 10 % at worst; variance of an axis 1.4 % and 7 %.
struct CovarianceSteps {
  double log_diagonal = 0.0;
  double lower = 0.0;
};
inline constexpr CovarianceSteps kKeyframeCovarianceSteps{1.0 / 512.0, 1.0 / 512.0};
inline constexpr CovarianceSteps kProxyCovarianceSteps{1.0 / 64.0, 1.0 / 16.0};

/// C = G G^T is coded by G, so whatever arrives is symmetric and positive semidefinite. Order: 6 diagonals, then the
/// lower triangle row by row. A coordinate with no variance has the diagonal code 0; one that the coordinates before it
/// determine to better than 1e-3 (sigma) is taken as determined to 1e-3.
CovarianceCode quantise(const Matrix6d& covariance, const CovarianceSteps& steps);
/// Nothing when a code is outside what quantise() makes.
std::optional<Matrix6d> dequantise(const CovarianceCode& code, const CovarianceSteps& steps);

}  // namespace tutti::wire
