// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/formats/pcd.hpp"

namespace tutti::bags {

/// Points in the message's frame, metres, and the time of each as it stands there (formats::is_time_field; int32,
/// uint32 or float). x, y, z are float32 or float64 at any offset, in either byte order; rows may be padded; points of
/// which not all numbers are finite are left out. An error says which field is missing, of another type or beyond its
/// point, or how many bytes were expected.
Result<formats::TimedCloud> to_timed_cloud(const RosPointCloud& message);

}  // namespace tutti::bags
