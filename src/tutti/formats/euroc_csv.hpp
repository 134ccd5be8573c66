// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::formats {

/// EuRoC MAV ground truth or state: `stamp[ns],px,py,pz,qw,qx,qy,qz` and any further columns (velocity, biases), which
/// are counted but not read. '#' starts a comment. Errors as for TUM files.
Result<Trajectory> parse_euroc_csv(std::string_view text, const std::string& name);
Result<Trajectory> read_euroc_csv(const std::string& path);

}  // namespace tutti::formats
