// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/formats/pcd.hpp"

namespace tutti::bags {

/// Points in the message's frame, m, and the unchanged times of the first field that formats::is_time_field() accepts
/// (int32, uint32, float32 or float64). x, y, z are float32 or float64 at any offset, in either byte order; rows may be
/// padded; points with a coordinate or a time that is not finite are left out, and so are those at 0, 0, 0, as which
/// drivers of Livox and Ouster write beams without an echo. Errors name which field is missing, of another type or
/// beyond its point, or how many bytes were expected.
Result<formats::TimedCloud> to_timed_cloud(const RosPointCloud& message);

/// A message of one row of points with these fields, each a float32 in this machine's byte order, packed in `data`. The
/// message is a view of `data`.
RosPointCloud to_point_cloud(const RosHeader& header, const std::vector<std::string>& fields, std::string_view data);
/// A message with x, y and z, which is a view of `points`.
RosPointCloud to_point_cloud(const RosHeader& header, std::span<const Eigen::Vector3f> points);

}  // namespace tutti::bags
