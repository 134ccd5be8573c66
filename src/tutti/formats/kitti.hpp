// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

/// What lies beside KITTI's poses (trajectory_file.hpp).
namespace tutti::formats {

/// A rigid motion as a 4x4 matrix, four rows of four; R as in poses, the last row 0 0 0 1, and nothing after it.
Result<Pose3> parse_transform(std::string_view text, const std::string& name);
Result<Pose3> read_transform(const std::string& path);

/// One stamp in seconds a line, strictly increasing, read exactly.
Result<std::vector<Timestamp>> parse_times(std::string_view text, const std::string& name);
Result<std::vector<Timestamp>> read_times(const std::string& path);

/// KITTI's scans: x, y, z and intensity of every point as little-endian floats, nothing else. Points with a non-finite
/// coordinate are dropped.
Result<PointCloud> parse_kitti_scan(std::string_view bytes, const std::string& name);
Result<PointCloud> read_kitti_scan(const std::string& path);

/// The same poses with other stamps; as many stamps as poses, strictly increasing.
Result<Trajectory> with_times(Trajectory poses, std::span<const Timestamp> times);

}  // namespace tutti::formats
