// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/point_cloud.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

namespace tutti::bags {
namespace {

enum Datatype : std::uint8_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kFloat32 = 7,
  kFloat64 = 8
};

std::uint32_t size_of(std::uint8_t datatype) {
  constexpr std::array<std::uint32_t, 9> kSizes{0, 1, 1, 2, 2, 4, 4, 4, 8};
  return datatype < kSizes.size() ? kSizes[datatype] : 0;
}

template <class T>
T number(const char* at, bool swapped) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, at, sizeof(T));
  if (swapped) std::reverse(bytes, bytes + sizeof(T));
  T out;
  std::memcpy(&out, bytes, sizeof(T));
  return out;
}

double number(const char* at, std::uint8_t datatype, bool swapped) {
  switch (datatype) {
    case kInt8:
      return number<std::int8_t>(at, swapped);
    case kUint8:
      return number<std::uint8_t>(at, swapped);
    case kInt16:
      return number<std::int16_t>(at, swapped);
    case kUint16:
      return number<std::uint16_t>(at, swapped);
    case kInt32:
      return number<std::int32_t>(at, swapped);
    case kUint32:
      return number<std::uint32_t>(at, swapped);
    case kFloat32:
      return number<float>(at, swapped);
    default:
      return number<double>(at, swapped);
  }
}

/// The field with this name, which must be one number within a point.
Result<RosPointField> field_of(const RosPointCloud& message, std::string_view name, bool may_be_integer) {
  const auto at = std::ranges::find(message.fields, name, &RosPointField::name);
  if (at == message.fields.end()) {
    std::string names;
    for (const RosPointField& field : message.fields) names += (names.empty() ? "" : " ") + field.name;
    return fail(ErrorCode::invalid, "no field '{}', expected x, y and z among '{:.200}'", name, names);
  }
  const bool is_float = at->datatype == kFloat32 || at->datatype == kFloat64;
  const bool is_integer = at->datatype >= kInt8 && at->datatype <= kUint32;
  if (!is_float && !(may_be_integer && is_integer))
    return fail(ErrorCode::unsupported, "field '{}' has datatype {}, expected 7 (float32) or 8 (float64){}", name,
                at->datatype, may_be_integer ? ", 1 to 6 (integers)" : "");
  if (std::uint64_t{at->offset} + size_of(at->datatype) > message.point_step)
    return fail(ErrorCode::invalid, "field '{}' at byte {} of points of {} bytes", name, at->offset,
                message.point_step);
  return *at;
}

/// Bytes of a row. Many drivers do not care what they state of a single row.
Result<std::uint64_t> row_bytes(const RosPointCloud& message) {
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  if (message.height > 1 && message.row_step < row)
    return fail(ErrorCode::invalid, "row_step {}, expected at least {} x {}", message.row_step, message.width,
                message.point_step);
  const std::uint64_t step = message.height > 1 ? message.row_step : row;
  const std::uint64_t wanted = message.height == 0 ? 0 : (message.height - 1) * step + row;
  if (message.data.size() < wanted)
    return fail(ErrorCode::invalid, "{} bytes of points, expected {} ({} rows of {} points of {} bytes)",
                message.data.size(), wanted, message.height, message.width, message.point_step);
  return step;
}

}  // namespace

Result<formats::TimedCloud> to_timed_cloud(const RosPointCloud& message) {
  std::array<RosPointField, 3> xyz;
  for (std::size_t i = 0; i < 3; ++i) {
    auto field = field_of(message, std::string_view("xyz").substr(i, 1), false);
    if (!field) return tl::unexpected(field.error());
    xyz[i] = *field;
  }
  std::optional<RosPointField> time;
  for (const RosPointField& field : message.fields) {
    if (time || !formats::is_time_field(field.name) || field.count > 1) continue;
    auto found = field_of(message, field.name, true);
    if (!found) return tl::unexpected(found.error());
    time = *found;
  }
  const auto step = row_bytes(message);
  if (!step) return tl::unexpected(step.error());
  const bool swapped = message.is_bigendian == (std::endian::native == std::endian::little);
  formats::TimedCloud out;
  if (time) out.time_field = time->name;
  // Rows without points take no bytes, so there may be four thousand millions.
  const std::uint32_t rows = message.width == 0 ? 0 : message.height;
  const std::size_t count = std::size_t{message.width} * rows;
  out.cloud.points.reserve(count);
  if (time) out.times.reserve(count);
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < message.width; ++column) {
      const char* const at = message.data.data() + row * *step + std::size_t{column} * message.point_step;
      Eigen::Vector3f point;
      for (int i = 0; i < 3; ++i) {
        const RosPointField& field = xyz[static_cast<std::size_t>(i)];
        point[i] = static_cast<float>(number(at + field.offset, field.datatype, swapped));
      }
      const double when = time ? number(at + time->offset, time->datatype, swapped) : 0.0;
      const bool has_echo = point != Eigen::Vector3f::Zero();
      if (!point.allFinite() || !has_echo || !std::isfinite(when)) continue;
      out.cloud.points.push_back(point);
      if (time) out.times.push_back(when);
    }
  return out;
}

RosPointCloud to_point_cloud(const RosHeader& header, const std::vector<std::string>& fields, std::string_view data) {
  RosPointCloud out{.header = header, .height = 1};
  for (const std::string& field : fields) {
    out.fields.push_back({field, out.point_step, kFloat32, 1});
    out.point_step += sizeof(float);
  }
  out.width = static_cast<std::uint32_t>(data.size() / out.point_step);
  out.is_bigendian = std::endian::native == std::endian::big;
  out.row_step = static_cast<std::uint32_t>(data.size());
  out.data = data;
  out.is_dense = true;
  return out;
}

RosPointCloud to_point_cloud(const RosHeader& header, std::span<const Eigen::Vector3f> points) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  return to_point_cloud(header, {"x", "y", "z"},
                        {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Eigen::Vector3f)});
}

}  // namespace tutti::bags
