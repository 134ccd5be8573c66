// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/misfit.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::fit {

/// How well a robot's odometry and scans say the same motion.
struct OdometryFit {
  std::size_t steps = 0;  ///< Steps of the scans for which there is odometry.
  /// Mean squared Mahalanobis distance of the steps from odometry, limited to kMostDistance2; about 6 where both are
  /// as good as their covariance says. As it is, and with all that was found corrected.
  double before = 0.0, after = 0.0;
  std::vector<Misfit> misfits;  ///< Largest first; empty where they fit, or where too little is known.
};

/// Fewer steps say nothing.
inline constexpr std::size_t kFewestSteps = 40;
/// A clock's offset is looked for up to this.
inline constexpr double kMostOffset_s = 5.0;

/// Compares the motion from scan to scan with odometry's over the same times. With E the error of the stated LiDAR pose
/// the scans show E B E^-1 where the body moves by B (hand-eye calibration: Shiu and Ahmad 1989); B is what odometry
/// says at stamps shifted by the clock's offset, with its translation scaled and turned in proportion to its length.
/// The eleven numbers are solved together by Gauss-Newton on the steps' covariances, with a robust loss. Where the
/// result is far off, odometry is read in other ways (MisfitKind) and the one that fits is taken. A number is reported
/// when it is large enough to matter, above five sigma, of one sign in both halves of the steps, and explains a share
/// of the contradiction. `odometry`: T_odom_body, no more than 50 ms apart, beyond the steps by kMostOffset_s if known.
OdometryFit fit_odometry(std::span<const ScanStep> steps, const Trajectory& odometry);

}  // namespace tutti::fit
