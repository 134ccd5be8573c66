// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::fit {

/// How far odometry moved, m, while scans lie on each other as they are and not where odometry puts them, so that they
/// are in the world's frame already; 0 where that is not so. For scans with too few points to be registered. Two scans
/// lie on each other where both have a point in a cube of 0.3 m. At most 500 points of a scan are looked at.
double moved_while_still(std::span<const lidar::PosedCloud> scans);

}  // namespace tutti::fit
