// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "tutti/perception/fit/scan_step.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

/// A submap's motions as its scans and images show them.
struct SubmapSteps {
  std::vector<fit::ScanStep> near;       ///< From scan to scan, and to the scan of its last keyframe.
  std::optional<fit::ScanStep> far;      ///< From the first scan to the last.
  Pose3 T_far_by_odometry;               ///< The same by odometry,
  double far_distance_m = 0.0;           ///< and along its path.
  double other_rad2 = 0.0;               ///< SteadyDrift::add(), as the near steps show it.
  double still_m = 0.0;                  ///< fit::moved_while_still(), where the scans cannot be registered.
  std::vector<fit::ScanStep> by_images;  ///< From keyframe to keyframe, of two cameras or one with depth.
  /// Those that are to stand for odometry where it stood still.
  [[nodiscard]] const std::vector<fit::ScanStep>& best() const { return near.empty() ? by_images : near; }
};
SubmapSteps steps_of(const FinishedSubmap& finished, double min_range_m);

/// Puts the steps' motion in the place of odometry's where odometry stood still and they moved (fit/standstill.hpp),
/// and takes `drift` (rad/m) out of odometry's elsewhere: in keyframes, odometry and the scans' poses. Returns what
/// odometry is to be multiplied by from the submap's end on; nothing where nothing is mended.
std::optional<Pose3> mend(const SubmapSteps& steps, double drift, FinishedSubmap& finished);

}  // namespace tutti::robot
