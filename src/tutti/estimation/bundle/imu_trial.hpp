// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

/// A run of IMU factors without a gap, and whether they are believed.
struct ImuRun {
  ChainId chain;
  std::size_t factors = 0;
  /// The accelerometer's bias in the middle of the run, in its least certain direction.
  double bias_sigma_mps2 = 0.0;
  double scale = 1.0;  ///< Length of the run's trajectory adjusted with all IMU factors, over its length without any.
  double scale_sigma = 0.0;  ///< Standard deviation of the length without IMU factors, as a share of it.
  bool is_held_back = false;
};

/// Solves `problem` with the IMU factors that can be believed, and removes the others from `problem`. An IMU measures
/// how far a robot went only once the accelerometer's bias is distinguished from gravity and from the motion itself: on
/// a short or steady flight the estimate moves the bias instead of the map, or the map instead of the bias. So the
/// problem is solved without IMU factors first, then with all of them. A run is left out where its bias stays
/// uncertain (BundleConfig::max_bias_sigma), or where it changes the length of the trajectory by more than odometry and
/// images permit (max_imu_scale_sigmas). `runs` receives one entry per run. Errors are those of
/// BundleAdjuster::adjust().
Result<BundleSolution> adjust_with_believed_imu(BundleProblem& problem, const BundleConfig& config,
                                                std::vector<ImuRun>& runs);

}  // namespace tutti::bundle
