// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"

/// Reads and writes Point Cloud Data files v0.7 (PCL), `DATA ascii`, `binary` (little endian) and `binary_compressed`.
/// x, y, z, m, are float or double at any position; of the other fields only a time is read. VIEWPOINT is not applied.
/// Points with a non-finite coordinate are dropped. The header's sizes must agree with each other and all points must
/// be there; bytes after the last point are ignored unless the file is ascii (PCL fills binary files up to a whole
/// page). An empty cloud is valid.
namespace tutti::formats {

/// True for the names under which files keep a point's time: t, time, timestamp, time_stamp, stamp, offset_time,
/// time_offset, relative_time.
bool is_time_field(std::string_view name);

/// Points, and the numbers of the first field that is_time_field() accepts, unchanged. perception/lidar/scan_times.hpp
/// finds out their unit and zero.
struct TimedCloud {
  PointCloud cloud;
  std::string time_field;     ///< Name of that field; empty when the file has none.
  std::vector<double> times;  ///< One per point, or empty.
};

Result<TimedCloud> parse_timed_pcd(std::string_view bytes, const std::string& name);
Result<TimedCloud> read_timed_pcd(const std::string& path);

/// A binary PCD file with float x, y, z.
std::string to_pcd(std::span<const Eigen::Vector3f> points);
Status write_pcd(const std::string& path, std::span<const Eigen::Vector3f> points);

}  // namespace tutti::formats
