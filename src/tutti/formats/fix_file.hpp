// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/position_fix.hpp"

namespace tutti::formats {

/// Reads position fixes of a receiver from a csv whose first line names its columns, in any order: stamp_s,
/// latitude_deg, longitude_deg, height_m and, all three or none, sigma_east_m, sigma_north_m, sigma_up_m. Without
/// sigmas a fix has PositionFix's default covariance, unknown. Stamps are decimal seconds by the odometry's clock, and
/// increase. The antenna is taken to be at the body's origin. Errors name file, line and value.
Result<std::vector<PositionFix>> read_fixes(const std::string& path);
/// As read_fixes(), from text; `name` stands for it in errors.
Result<std::vector<PositionFix>> parse_fixes(std::string_view text, const std::string& name);

}  // namespace tutti::formats
