// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"

/// Reads and writes trajectories as TUM, EuRoC csv or KITTI. '#' starts a comment. Errors name file and line: wrong
/// column count, NaN or infinity, a quaternion off unit norm by more than 1e-3, stamps that do not increase.
namespace tutti::formats {

/// TUM: one `stamp[s] x y z qx qy qz qw` a line (metres, Hamilton quaternion). Stamps go between decimal text and
/// nanoseconds exactly, never through a double. With `left_out`, a pose whose stamp does not come after the one before
/// is no error: it is left out and reported there.
Result<Trajectory> parse_tum(std::string_view text, const std::string& name, std::vector<Error>* left_out = nullptr);
/// Stamps with nine decimals, other numbers with the fewest digits that read back the same: parse_tum(to_tum(t)) == t.
std::string to_tum(const Trajectory& trajectory);
Status write_tum(const std::string& path, const Trajectory& trajectory);

/// EuRoC MAV ground truth or state: `stamp[ns],px,py,pz,qw,qx,qy,qz` and any further columns (velocity, biases), which
/// are counted but not read.
Result<Trajectory> parse_euroc_csv(std::string_view text, const std::string& name);
/// The first eight columns: parse_euroc_csv(to_euroc_csv(t)) == t.
std::string to_euroc_csv(const Trajectory& trajectory);
Status write_euroc_csv(const std::string& path, const Trajectory& trajectory);

/// KITTI odometry: a pose is 12 numbers a line, the row-major 3x4 matrix [R t] of T_world_body. The file has no stamps:
/// pose k gets start + k / rate_hz, 0.01 <= rate_hz <= 1e6. R is printed with few digits, so it must be a rotation
/// within 1e-3 (each entry of R^T R, det > 0) and is then projected to SO(3).
Result<Trajectory> parse_kitti_poses(std::string_view text, const std::string& name, double rate_hz, Timestamp start);
/// KITTI's lines, without the stamps; rotations read back but for rounding.
std::string to_kitti_poses(const Trajectory& trajectory);
Status write_kitti_poses(const std::string& path, const Trajectory& trajectory);

/// `format`: tum, euroc, kitti (stamps k / kitti_rate_hz), or auto, which decides by the first row that is not a
/// comment: commas mean EuRoC csv, 12 columns KITTI, anything else TUM. `left_out`: as in parse_tum(), for TUM and
/// EuRoC.
Result<Trajectory> read_trajectory(const std::string& path, std::string_view format = "auto",
                                   double kitti_rate_hz = 10.0, std::vector<Error>* left_out = nullptr);

}  // namespace tutti::formats
