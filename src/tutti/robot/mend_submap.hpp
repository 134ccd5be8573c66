// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tutti/model/submap.hpp"
#include "tutti/perception/fit/scan_step.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::robot {

/// The motions from scan to scan of a submap, and to the scan of its last keyframe (FinishedSubmap::scan_after).
std::vector<fit::ScanStep> scan_steps(std::span<const lidar::PosedCloud> scans,
                                      const std::optional<lidar::PosedCloud>& after, double min_range_m);

/// Puts the scans' motion in the place of odometry's where odometry stood still and they moved (fit/standstill.hpp), in
/// keyframes, odometry and the scans' poses, so that the submap is as if odometry had gone on. Returns
/// what odometry is to be multiplied by from the submap's end on; nothing where nothing is mended.
std::optional<Pose3> mend_standstills(std::span<const fit::ScanStep> steps,
                                      const std::optional<lidar::PosedCloud>& after,
                                      std::vector<lidar::PosedCloud>& scans, Submap& submap);

}  // namespace tutti::robot
