// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_problem.hpp"
#include "tutti/estimation/robust_loss.hpp"

namespace tutti::bundle {

struct BundleConfig {
  int max_iterations = 30;                ///< Limit on the Levenberg-Marquardt steps.
  double relative_cost_tolerance = 1e-4;  ///< Converged when a step lowers the cost by less than this share of it.
  estimation::RobustLoss view_loss{estimation::LossKind::cauchy, 2.0};  ///< In standard deviations of a view.
  estimation::RobustLoss odometry_loss{estimation::LossKind::cauchy, 5.0};
  double odometry_scale_sigma = 0.02;
  double gyro_random_walk = 1e-4;           ///< Random walk of the gyro's bias, rad/s^2/sqrt(Hz).
  double accelerometer_random_walk = 4e-3;  ///< Random walk of the accelerometer's bias, m/s^3/sqrt(Hz).
  double max_bias_sigma = 0.05;  ///< A run of IMU factors is left out when the accelerometer's bias stays less certain
                                 ///< than this, m/s^2 (a tenth of its prior's standard deviation),
  double max_imu_scale_sigmas = 3.0;  ///< ... or when it changes the length of the trajectory by more than this many
                                      ///< standard deviations of that length without IMU factors.

  template <class V>
  void describe(V& v) {
    v.field("odometry_scale_sigma", odometry_scale_sigma, greater_than(0.0),
            "By how much odometry may be wrong in scale all along its trajectory, beside its covariance.");
  }
};

/// Solves a bundle problem. The interface keeps Ceres out of the headers.
class BundleAdjuster {
 public:
  virtual ~BundleAdjuster() = default;
  /// Refuses numbers that are not finite and indices out of range, by name. A numerical failure is no error but in the
  /// summary, and the poses are then the given ones.
  [[nodiscard]] virtual Result<BundleSolution> adjust(const BundleProblem& problem) const = 0;
};

/// Levenberg-Marquardt of Ceres, landmarks eliminated (Schur complement), one thread.
std::unique_ptr<BundleAdjuster> make_ceres_bundle_adjuster(const BundleConfig& config);

}  // namespace tutti::bundle
