// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

/// Reads the other files of a KITTI recording: transforms, stamps and scans. Its poses are in trajectory_file.hpp.
/// Errors name file and line.
namespace tutti::formats {

/// A rigid transform as four rows of four numbers: R as in KITTI's poses, the last row 0 0 0 1, and nothing after it.
Result<Pose3> parse_transform(std::string_view text, const std::string& name);
Result<Pose3> read_transform(const std::string& path);

/// One stamp in seconds a line, strictly increasing, read exactly.
Result<std::vector<Timestamp>> parse_times(std::string_view text, const std::string& name);
Result<std::vector<Timestamp>> read_times(const std::string& path);

/// A scan: x, y, z (sensor frame, m) and intensity of every point as little-endian floats, nothing else. Points with a
/// non-finite coordinate are dropped.
Result<PointCloud> parse_kitti_scan(std::string_view bytes, const std::string& name);
Result<PointCloud> read_kitti_scan(const std::string& path);
/// A scan's bytes, with intensities of 0.
std::string to_kitti_scan(std::span<const Eigen::Vector3f> points);

/// The poses with other stamps, of which there must be one per pose, strictly increasing; else ErrorCode::invalid.
Result<Trajectory> with_times(Trajectory poses, std::span<const Timestamp> times);

}  // namespace tutti::formats
