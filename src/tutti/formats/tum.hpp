// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"

/// TUM trajectories: one `stamp[s] x y z qx qy qz qw` a line (metres, Hamilton quaternion), '#' starts a comment.
/// Stamps go between decimal text and nanoseconds exactly, never through a double. Errors name file and line:
/// wrong column count, NaN or infinity, quaternion off unit norm by more than 1e-3, stamps that do not increase.
namespace tutti::formats {

Result<Trajectory> parse_tum(std::string_view text, const std::string& name);
Result<Trajectory> read_tum(const std::string& path);

/// Nine decimals for stamps, shortest digits that read back the same for the rest: parse_tum(to_tum(t)) == t.
std::string to_tum(const Trajectory& trajectory);
Status write_tum(const std::string& path, const Trajectory& trajectory);

}  // namespace tutti::formats
