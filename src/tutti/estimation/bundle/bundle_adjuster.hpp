// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle {

struct BundleConfig {
  int max_iterations = 30;                ///< Steps at most.
  double relative_cost_tolerance = 1e-4;  ///< Converged when a step lowers the cost by less than this share of it.
  std::string loss = "cauchy";
  double loss_scale = 2.0;           ///< Its scale, in standard deviations.
  double odometry_loss_scale = 5.0;  ///< Scale of the Cauchy loss on odometry, in standard deviations.
  double odometry_scale_sigma = 0.02;
  double gyro_random_walk = 1e-4;           ///< Of the gyro's bias, rad/s^2/sqrt(Hz).
  double accelerometer_random_walk = 4e-3;  ///< Of the accelerometer's bias, m/s^3/sqrt(Hz).
  double max_bias_sigma = 0.05;  ///< IMU factors are held back where motion does not tell the accelerometer's bias this
                                 ///< well, m/s^2 (a tenth of what is known beforehand),
  double max_imu_scale_sigmas = 3.0;  ///< ... and where they make the way longer or shorter by more than so many of its
                                      ///< standard deviations without them.

  template <class V>
  void describe(V& v) {
    v.field("loss", loss, one_of({"none", "huber", "cauchy", "geman_mcclure"}), "Robust loss on the views.");
    v.field("odometry_scale_sigma", odometry_scale_sigma, greater_than(0.0),
            "By how much odometry may be wrong in scale all along its way, beside its covariance.");
  }
};

/// Solves a bundle problem. Implementations differ in the library that they use.
class BundleAdjuster {
 public:
  virtual ~BundleAdjuster() = default;
  /// Refuses what is not finite, by name. Numerical failure is in the summary.
  [[nodiscard]] virtual Result<BundleSolution> adjust(const BundleProblem& problem) const = 0;
};

/// Levenberg-Marquardt of Ceres, landmarks eliminated (Schur complement), one thread.
std::unique_ptr<BundleAdjuster> make_ceres_bundle_adjuster(const BundleConfig& config);

}  // namespace tutti::bundle
