// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/points.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace tutti::formats::internal {
namespace {

static_assert(std::endian::native == std::endian::little, "binary point files are little endian");

float coordinate_of(const char* record, const Coordinate& coordinate) {
  if (!coordinate.is_double) {
    float value = 0.0F;
    std::memcpy(&value, record + coordinate.offset, sizeof value);
    return value;
  }
  double value = 0.0;
  std::memcpy(&value, record + coordinate.offset, sizeof value);
  return to_float(value);
}

}  // namespace

float to_float(double value) {
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max()))
    return std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

std::vector<Eigen::Vector3f> binary_points(std::string_view data, std::size_t count, const RecordLayout& layout) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* record = data.data() + i * layout.stride;
    const Eigen::Vector3f p(coordinate_of(record, layout.xyz[0]), coordinate_of(record, layout.xyz[1]),
                            coordinate_of(record, layout.xyz[2]));
    if (p.allFinite()) points.push_back(p);
  }
  return points;
}

Result<std::vector<Eigen::Vector3f>> ascii_points(LineReader& line, std::size_t count, const RecordLayout& layout) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(std::min(count, line.rest().size()));
  for (std::size_t i = 0; i < count; ++i) {
    if (!line.next())
      return fail(ErrorCode::parse, "{}: ends after {} points, expected {} as its header says", line.name(), i, count);
    if (line.columns().size() != layout.columns)
      return line.fail(ErrorCode::parse, "point has {} columns, expected {} as the header says", line.columns().size(),
                       layout.columns);
    Eigen::Vector3f p;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view text = line.columns()[layout.xyz[static_cast<std::size_t>(axis)].column];
      const auto value = parse_number(text);
      if (!value) return line.fail(ErrorCode::parse, "coordinate is {}, expected a number", shown(text));
      p[axis] = to_float(*value);
    }
    if (p.allFinite()) points.push_back(p);
  }
  return points;
}

}  // namespace tutti::formats::internal
