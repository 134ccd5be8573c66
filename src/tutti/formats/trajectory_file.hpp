// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::formats {

enum class TrajectoryFormat { automatic, tum, euroc, kitti };

/// Reads a trajectory in any of our formats. `automatic` looks at the first row that is not a comment: commas mean
/// EuRoC csv, 12 columns KITTI, anything else TUM. KITTI poses get the stamps k / kitti_rate_hz.
Result<Trajectory> read_trajectory(const std::string& path, TrajectoryFormat format = TrajectoryFormat::automatic,
                                   double kitti_rate_hz = 10.0);

}  // namespace tutti::formats
