// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/formats/internal/text.hpp"

/// Where a text has the stamp and the pose of a row.
namespace tutti::formats::internal {

struct TrajectoryLayout {
  std::string format;   ///< As `--format` has it: tum, euroc or kitti.
  std::string columns;  ///< Their names, for messages.
  std::size_t count = 0;
  Separator separator = Separator::whitespace;
  std::size_t header_rows = 0;          ///< Rows of words before the first pose.
  bool is_named = false;                ///< The columns are those that names say.
  std::optional<std::size_t> stamp;     ///< None: row k has the stamp k / rate.
  std::optional<std::size_t> fraction;  ///< Nanoseconds beside the seconds in `stamp`.
  bool is_numbered = false;             ///< `stamp` is the row's number k.
  int stamp_exponent = 0;               ///< Power of ten: 0 for seconds, -9 for nanoseconds.
  bool is_matrix = false;
  std::array<std::size_t, 7> at = {1, 2, 3, 4, 5, 6, 7};  ///< x y z qx qy qz qw
  std::size_t matrix = 0;                                 ///< Column of the first of 12 numbers.
  std::size_t ignored = 0;                                ///< Columns that are not read.
  /// Columns that a row must have: those up to the last one that is read. A matrix has all.
  [[nodiscard]] std::size_t needed() const {
    const std::size_t last = std::max({stamp.value_or(0), fraction.value_or(0), *std::ranges::max_element(at)});
    return is_matrix ? count : last + 1;
  }
};

TrajectoryLayout tum_layout();
/// With `count` columns, 8 or more.
TrajectoryLayout euroc_layout(std::size_t count);
TrajectoryLayout kitti_layout();
/// `format`: tum, euroc or kitti, or auto. Names of columns, in a first row or a comment before it, come first; then
/// the number of columns and what the stamps look like.
TrajectoryLayout find_layout(std::string_view text, std::string_view format);

}  // namespace tutti::formats::internal
