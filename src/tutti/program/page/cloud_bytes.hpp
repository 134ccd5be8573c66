// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/model/point_cloud.hpp"

namespace tutti::page {

/// A cloud as the page reads it, little-endian: float32 step_m, uint32 n, then n times int16 x, y, z in steps. In an
/// order that depends on the number of points alone, such that any prefix is a thinner cloud. Points that are not
/// finite are left out, and when there are more than `at_most` the rest of that order.
std::string cloud_bytes(const PointCloud& cloud, std::size_t at_most);

}  // namespace tutti::page
