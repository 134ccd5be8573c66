// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"

/// Point Cloud Data files v0.7 (PCL), `DATA ascii` and `DATA binary` (little endian). x, y, z are float or double at
/// any position; other fields are skipped; VIEWPOINT is not applied; points with a non-finite coordinate are dropped.
/// The header's sizes must agree with each other and with the length of the data; an empty cloud is a valid one.
/// `binary_compressed` is ErrorCode::unsupported.
namespace tutti::formats {

Result<PointCloud> parse_pcd(std::string_view bytes, const std::string& name);
Result<PointCloud> read_pcd(const std::string& path);

/// Binary, fields x y z, float.
std::string to_pcd(const PointCloud& cloud);
Status write_pcd(const std::string& path, const PointCloud& cloud);

}  // namespace tutti::formats
