// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/formats/internal/text.hpp"

/// Point files have records of fixed size with x, y, z somewhere in them.
namespace tutti::formats::internal {

/// Bound on one header number, so that products of two fit an int64 and nonsense is refused before it is allocated.
inline constexpr std::int64_t kMaxCount = std::int64_t{1} << 31;

/// One number within a record.
struct NumberField {
  bool found = false;
  std::size_t offset = 0;  ///< Bytes, in binary files.
  std::size_t column = 0;  ///< In ascii files.
  std::size_t size = 4;    ///< Bytes, in binary files: 4 or 8.
  char type = 'F';         ///< Float, I: signed or U: unsigned integer.
};

struct RecordLayout {
  std::array<NumberField, 3> xyz;
  NumberField time;            ///< When a point was measured, if the file has it;
  std::string_view time_name;  ///< and what it calls that.
  std::size_t stride = 0;      ///< Bytes a record.
  std::size_t columns = 0;     ///< Columns a record.
  bool moves = false;          ///< Points far from the origin are read from a nearer one: Records::origin.
};

/// Infinite where the value is beyond a float's range (a plain cast would be undefined).
float to_float(double value);

/// Points that are finite, and the times of these, if the layout has any, as they stand in the file.
struct Records {
  std::vector<Eigen::Vector3f> points;
  std::vector<double> times;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< To be added to the points, in double.
};

/// From `count` binary records.
Records binary_points(std::string_view data, std::size_t count, const RecordLayout& layout);
/// From the next `count` lines.
Result<Records> ascii_points(LineReader& line, std::size_t count, const RecordLayout& layout);

/// Appends the bytes of a little-endian number.
template <class T>
void put(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace tutti::formats::internal
