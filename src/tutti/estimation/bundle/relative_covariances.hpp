// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

/// Variance of the views in units of what they claim (sigma_px), at the solution: their median squared residual over
/// that of noise of which the landmarks have absorbed their share; 1 where they are as good as they say.
double view_variance(const BundleProblem& problem, const BundleSolution& solution);

/// The joint Gauss-Newton posterior at the solution, landmarks eliminated (Schur complement). Views weigh as the robust
/// loss left them, and less by view_variance() where that is above 1. A robot's odometry has one scale, known to
/// odometry_scale_sigma and to what the rest of the problem says of it: without a second camera, depth or an IMU its
/// steps are as unsure of their lengths as that.
class Posterior {
 public:
  /// Nothing when the problem does not determine every pose.
  static std::optional<Posterior> of(const BundleProblem& problem, const BundleSolution& solution,
                                     const BundleConfig& config);
  Posterior(Posterior&&) noexcept;
  ~Posterior();
  /// Covariance of T_from_to (right tangent) between the ends of every odometry factor, in their order: blocks of the
  /// inverse, computed on the pattern of its sparse Cholesky factor alone. Nothing when that lost its digits.
  [[nodiscard]] std::optional<std::vector<Matrix6d>> steps() const;
  /// Of a number that depends on poses: its derivatives by the tangents of some keyframes.
  [[nodiscard]] double variance_of(const std::vector<std::pair<std::size_t, Vector6d>>& gradient) const;

  /// Covariance of the bias at a keyframe where an IMU factor ends.
  [[nodiscard]] Eigen::Matrix3d accelerometer_bias(std::size_t keyframe) const;

 private:
  struct State;
  explicit Posterior(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Posterior::steps(); nothing where there is none.
std::optional<std::vector<Matrix6d>> odometry_posterior(const BundleProblem& problem, const BundleSolution& solution,
                                                        const BundleConfig& config);

}  // namespace tutti::bundle
