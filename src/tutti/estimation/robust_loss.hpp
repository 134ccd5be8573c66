// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace tutti::estimation {

/// The cost rho(s) of a factor with whitened squared error s = r^T Omega r, with c = scale (same unit as sqrt(s)):
///   none     rho = s
///   huber    rho = s for s <= c^2, else 2 c sqrt(s) - c^2
///   cauchy   rho = c^2 log(1 + s / c^2)
/// All have rho(0) = 0 and rho'(0) = 1, so inliers weigh what they weigh without a loss.
enum class LossKind { none, huber, cauchy };

struct RobustLoss {
  LossKind kind = LossKind::none;
  double scale = 1.0;  ///< > 0

  [[nodiscard]] double rho(double s) const;
  /// Weight of the factor in iteratively re-weighted least squares: rho'(s), in (0, 1].
  [[nodiscard]] double weight(double s) const;
  /// Second derivative of rho(r^2) / 2 by r, as a share of the weight, at s = r^2: 1 + 2 s rho''(s) / rho'(s). Where
  /// that is below 0.1, so that the loss is hardly convex or not at all, 1 is returned instead: there only re-weighting
  /// is safe.
  [[nodiscard]] double curvature(double s) const;
};

/// The kind of a name on the command line or in Python ("none", "huber", "cauchy"); another name is a bug of the
/// caller.
LossKind loss_kind(const std::string& name);

}  // namespace tutti::estimation
