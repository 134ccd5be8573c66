// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

/// Variance of the views over the variance that they claim (sigma_px^2), at the solution: 1 where they are as good as
/// claimed. It is the median squared residual over that of unit noise, less the degrees of freedom that the landmarks
/// absorb.
double view_variance(const BundleProblem& problem, const BundleSolution& solution);

/// The joint Gauss-Newton posterior at the solution, landmarks eliminated (Schur complement). Views weigh as the robust
/// loss left them, and less by view_variance() where it is above 1. Each robot's odometry has an unknown common scale
/// with the prior odometry_scale_sigma: without a second camera, depth or an IMU, nothing else measures how long the
/// steps are.
class Posterior {
 public:
  /// No value when the problem does not determine every pose.
  static std::optional<Posterior> of(const BundleProblem& problem, const BundleSolution& solution,
                                     const BundleConfig& config);
  Posterior(Posterior&&) noexcept;
  ~Posterior();
  /// Covariance of T_from_to (right tangent) between the ends of every odometry factor, in their order: blocks of the
  /// inverse, computed on the pattern of its sparse Cholesky factor alone. No value when the factorisation lost its
  /// precision.
  [[nodiscard]] std::optional<std::vector<Matrix6d>> steps() const;
  /// Variance of a scalar function of the poses, from its derivatives by the right tangents of some keyframes.
  [[nodiscard]] double variance_of(const std::vector<std::pair<std::size_t, Vector6d>>& gradient) const;

  /// Covariance of the bias at a keyframe where an IMU factor ends.
  [[nodiscard]] Eigen::Matrix3d accelerometer_bias(std::size_t keyframe) const;

 private:
  struct State;
  explicit Posterior(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Posterior::of() and then Posterior::steps(); no value when either has none.
std::optional<std::vector<Matrix6d>> odometry_posterior(const BundleProblem& problem, const BundleSolution& solution,
                                                        const BundleConfig& config);

}  // namespace tutti::bundle
