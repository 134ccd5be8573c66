// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

/// IMU factors one after the other without a gap, and whether they are believed.
struct ImuRun {
  ChainId chain;
  std::size_t factors = 0;
  double bias_sigma_mps2 = 0.0;  ///< Of the accelerometer's bias in its least certain direction, with these factors.
  double scale = 1.0;            ///< Of its way: with all IMU factors over without any.
  double scale_sigma = 0.0;      ///< Of the way without any.
  bool is_held_back = false;
};

/// Solves a problem with the IMU factors that can be believed, and drops the others from it. An IMU says how far a
/// robot went only once its accelerometer's bias is told from gravity and from the motion itself: on a short or steady
/// flight the estimate moves the bias instead of the map, or the map instead of the bias. So the problem is solved
/// without IMU factors first, then with them. A run of them is held back where its bias is not told apart
/// (BundleConfig::max_bias_sigma), or where it makes the way longer or shorter by more than odometry and images permit
/// (max_imu_scale_sigmas). Without IMU factors it is the adjuster's own solution.
Result<BundleSolution> adjust_with_believed_imu(BundleProblem& problem, const BundleConfig& config,
                                                std::vector<ImuRun>& runs);

}  // namespace tutti::bundle
