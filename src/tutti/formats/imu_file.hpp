// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::formats {

/// EuRoC's raw IMU: `stamp[ns],wx,wy,wz[rad/s],ax,ay,az[m/s^2]`; '#' starts a comment. Errors name file and line: wrong
/// column count, NaN or infinity, values no IMU has, stamps that do not increase.
Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text, const std::string& name);
Result<std::vector<ImuSample>> read_imu_csv(const std::string& path);

}  // namespace tutti::formats
