// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::formats {

/// Reads IMU samples as EuRoC's csv: `stamp[ns],wx,wy,wz[rad/s],ax,ay,az[m/s^2]`; '#' starts a comment. Errors name
/// file and line: wrong column count, NaN or infinity, values that no IMU has (beyond 1e3 rad/s or 1e5 m/s^2), stamps
/// that do not increase.
Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text, const std::string& name);
Result<std::vector<ImuSample>> read_imu_csv(const std::string& path);

}  // namespace tutti::formats
