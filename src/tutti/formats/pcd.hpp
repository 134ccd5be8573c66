// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"

/// Point Cloud Data files v0.7 (PCL), `DATA ascii`, `binary` (little endian) and `binary_compressed`. x, y, z are float
/// or double at any position; of the other fields only a time is read; VIEWPOINT is not applied; points with a
/// non-finite coordinate are dropped. The header's sizes must agree with each other and the points must all be there;
/// bytes after the last of them are passed over unless the file is ascii (PCL fills binary files up to a whole page).
/// An empty cloud is a valid one.
namespace tutti::formats {

/// Is it a point's time that a field of this name holds: t, time, timestamp, time_stamp, stamp, offset_time,
/// time_offset or relative_time?
bool is_time_field(std::string_view name);

/// Points and when each of them was measured: numbers of the first field that is_time_field(), as they stand there.
/// Unit and zero are for the caller to find out.
struct TimedCloud {
  PointCloud cloud;
  std::string time_field;     ///< Empty: the file has no times.
  std::vector<double> times;  ///< One per point, or empty.
};

Result<TimedCloud> parse_timed_pcd(std::string_view bytes, const std::string& name);
Result<TimedCloud> read_timed_pcd(const std::string& path);

}  // namespace tutti::formats
