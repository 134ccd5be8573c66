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

template <class T>
double read_as(const char* bytes) {
  T value{};
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double number_in(const char* record, const NumberField& field) {
  const char* bytes = record + field.offset;
  if (field.type == 'F') return field.size == 8 ? read_as<double>(bytes) : read_as<float>(bytes);
  if (field.type == 'I') return field.size == 8 ? read_as<std::int64_t>(bytes) : read_as<std::int32_t>(bytes);
  return field.size == 8 ? read_as<std::uint64_t>(bytes) : read_as<std::uint32_t>(bytes);
}

/// `number` of a field.
template <class Number>
void append(Records& records, const RecordLayout& layout, const Number& number) {
  constexpr double kFar_m = 1000.0;  // where a float's steps are a tenth of a millimetre
  const Eigen::Vector3d at(number(layout.xyz[0]), number(layout.xyz[1]), number(layout.xyz[2]));
  if (layout.moves && records.points.empty() && at.allFinite() && at.norm() > kFar_m)
    records.origin = at.array().round();
  const Eigen::Vector3d near = at - records.origin;
  const Eigen::Vector3f p(to_float(near.x()), to_float(near.y()), to_float(near.z()));
  if (!p.allFinite()) return;
  records.points.push_back(p);
  if (layout.time.found) records.times.push_back(number(layout.time));
}

}  // namespace

float to_float(double value) {
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max()))
    return std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

Records binary_points(std::string_view data, std::size_t count, const RecordLayout& layout) {
  Records records;
  records.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* record = data.data() + i * layout.stride;
    append(records, layout, [record](const NumberField& field) { return number_in(record, field); });
  }
  return records;
}

Result<Records> ascii_points(LineReader& line, std::size_t count, const RecordLayout& layout) {
  Records records;
  records.points.reserve(std::min(count, line.rest().size()));
  for (std::size_t i = 0; i < count; ++i) {
    if (!line.next())
      return fail(ErrorCode::parse, "{}: ends after {} points, expected {} as its header says", line.name(), i, count);
    if (line.columns().size() != layout.columns)
      return line.fail(ErrorCode::parse, "point has {} columns, expected {} as the header says", line.columns().size(),
                       layout.columns);
    std::string_view no_number;
    append(records, layout, [&](const NumberField& field) {
      const auto value = parse_number(line.columns()[field.column]);
      if (!value) no_number = line.columns()[field.column];
      return value.value_or(0.0);
    });
    if (!no_number.empty())
      return line.fail(ErrorCode::parse, "a coordinate or time is {}, expected a number", shown(no_number));
  }
  return records;
}

}  // namespace tutti::formats::internal
