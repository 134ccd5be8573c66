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
/// nanoseconds exactly, never through a double.
Result<Trajectory> parse_tum(std::string_view text, const std::string& name);
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

/// How read_trajectory() took rows that are not as they should be.
struct RowReport {
  std::vector<Error> left_out;      ///< Why each row is not in the trajectory.
  std::size_t steps_back = 0;       ///< Rows that are earlier than the one before them.
  std::size_t ignored_columns = 0;  ///< Beside stamp and pose.
  double rows_hz = 0.0;             ///< How many rows were taken for a second; 0: they have stamps.
  /// A sentence for each of these that there are.
  [[nodiscard]] std::vector<std::string> notes(const std::string& path) const;
};

/// Reads what other programs write: `format` is tum, euroc, kitti (stamps k / kitti_rate_hz where it has none), or
/// auto. Blanks, commas or semicolons separate; names of columns in a first row or in the comment before it are heeded;
/// stamps may count s, ms, us or ns; a matrix may have 12 or 16 numbers, with a stamp before it. With `report`, a row
/// that cannot be read, has a stamp twice or is not finite is left out, and rows are sorted; a file most of whose rows
/// cannot be read is an error all the same, and without `report` any such row is.
Result<Trajectory> read_trajectory(const std::string& path, std::string_view format = "auto",
                                   double kitti_rate_hz = 10.0, RowReport* report = nullptr);

}  // namespace tutti::formats
