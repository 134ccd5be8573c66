// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/pcd.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "tutti/formats/internal/lzf.hpp"
#include "tutti/formats/internal/placed_pcd.hpp"
#include "tutti/formats/internal/points.hpp"

namespace tutti::formats {
namespace {

using internal::LineReader;
using internal::shown;

constexpr std::array<std::string_view, 8> kTimeNames = {"t",     "time",        "timestamp",   "time_stamp",
                                                        "stamp", "offset_time", "time_offset", "relative_time"};

struct Field {
  std::string_view name;
  std::string_view type;  // "F", "I" or "U"
  std::int64_t size = 0;
  std::int64_t count = 1;
};

struct Header {
  std::vector<Field> fields;
  std::int64_t width = -1;
  std::int64_t height = 1;
  std::int64_t points = -1;
  std::string_view data;  // "ascii", "binary", ...
};

Result<std::int64_t> count_at(const LineReader& line, std::size_t column, std::string_view what) {
  const auto value = line.integer(column, what);
  if (value && (*value < 0 || *value > internal::kMaxCount))
    return line.fail(ErrorCode::parse, "{} is {}, expected 0 to {}", what, *value, internal::kMaxCount);
  return value;
}

/// One keyword line that has an entry per field.
Status read_per_field(const LineReader& line, std::span<const std::string_view> values, std::vector<Field>& fields) {
  const std::string_view keyword = line.columns()[0];
  if (values.size() != fields.size())
    return line.fail(ErrorCode::parse, "{} has {} entries, expected {} as FIELDS", keyword, values.size(),
                     fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (keyword == "TYPE") {
      fields[i].type = values[i];
      continue;
    }
    const auto value = count_at(line, i + 1, keyword);
    if (!value) return tl::unexpected(value.error());
    (keyword == "SIZE" ? fields[i].size : fields[i].count) = *value;
  }
  return {};
}

/// Reads up to and including the DATA line.
Result<Header> read_header(LineReader& line) {
  Header header;
  while (line.next()) {
    const std::string_view keyword = line.columns()[0];
    const std::span<const std::string_view> values = line.columns().subspan(1);
    if (keyword == "VERSION" || keyword == "VIEWPOINT") continue;
    if (keyword == "FIELDS") {
      header.fields.clear();
      for (const std::string_view name : values) header.fields.push_back({.name = name});
    } else if (keyword == "SIZE" || keyword == "TYPE" || keyword == "COUNT") {
      if (auto ok = read_per_field(line, values, header.fields); !ok) return tl::unexpected(ok.error());
    } else if (keyword == "WIDTH" || keyword == "HEIGHT" || keyword == "POINTS" || keyword == "DATA") {
      if (values.size() != 1)
        return line.fail(ErrorCode::parse, "{} has {} entries, expected 1", keyword, values.size());
      if (keyword == "DATA") {
        header.data = values[0];
        return header;
      }
      const auto value = count_at(line, 1, keyword);
      if (!value) return tl::unexpected(value.error());
      (keyword == "WIDTH" ? header.width : keyword == "HEIGHT" ? header.height : header.points) = *value;
    } else {
      return line.fail(ErrorCode::parse, "header keyword is {}, expected one of PCD v0.7", shown(keyword));
    }
  }
  return fail(ErrorCode::parse, "{}: no DATA line, expected a PCD v0.7 header", line.name());
}

Result<internal::RecordLayout> layout_of(const Header& header, const std::string& name) {
  internal::RecordLayout layout;
  for (const Field& field : header.fields) {
    const bool known_type = field.type == "F" || field.type == "I" || field.type == "U";
    const bool known_size = field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8;
    if (!known_type || !known_size)
      return fail(ErrorCode::parse, "{}: field {} has type {} and size {}, expected F, I or U of 1, 2, 4 or 8 bytes",
                  name, shown(field.name), shown(field.type), field.size);
    if (field.name == "x" || field.name == "y" || field.name == "z") {
      if (field.type != "F" || field.size < 4 || field.count != 1)
        return fail(ErrorCode::unsupported, "{}: field {} is {} x {}{}, expected one F4 or F8", name, field.name,
                    field.count, field.type, field.size);
      layout.xyz[static_cast<std::size_t>(field.name[0] - 'x')] = {true, layout.stride, layout.columns,
                                                                   static_cast<std::size_t>(field.size)};
    }
    if (is_time_field(field.name) && !layout.time.found && field.size >= 4 && field.count == 1) {
      layout.time = {true, layout.stride, layout.columns, static_cast<std::size_t>(field.size), field.type[0]};
      layout.time_name = field.name;
    }
    layout.stride += static_cast<std::size_t>(field.size * field.count);
    layout.columns += static_cast<std::size_t>(field.count);
    if (layout.stride > static_cast<std::size_t>(internal::kMaxCount))
      return fail(ErrorCode::parse, "{}: a point has {} bytes, expected fewer", name, layout.stride);
  }
  for (const auto& coordinate : layout.xyz)
    if (!coordinate.found)
      return fail(ErrorCode::parse, "{}: fields x, y and z expected, at least one is not there", name);
  return layout;
}

/// The records of a compressed file, which has two sizes and then all values of one field after those of another.
Result<std::string> decompress(std::string_view data, std::size_t count, const Header& header,
                               const internal::RecordLayout& layout, const std::string& name) {
  std::array<std::uint32_t, 2> sizes{};  // compressed, decompressed
  if (data.size() < sizeof sizes)
    return fail(ErrorCode::parse, "{}: {} bytes of data, expected the two sizes of compressed data", name, data.size());
  std::memcpy(sizes.data(), data.data(), sizeof sizes);
  data.remove_prefix(sizeof sizes);
  if (data.size() < sizes[0])
    return fail(ErrorCode::parse, "{}: {} bytes of compressed data, expected {}", name, data.size(), sizes[0]);
  if (sizes[1] / layout.stride != count || sizes[1] % layout.stride != 0)
    return fail(ErrorCode::parse, "{}: {} bytes of decompressed data, expected {} points of {} bytes", name, sizes[1],
                count, layout.stride);
  const auto values = internal::lzf_decode(data.substr(0, sizes[0]), sizes[1]);
  if (!values) return fail(ErrorCode::parse, "{}: compressed data are damaged, expected {} bytes", name, sizes[1]);
  std::string records(values->size(), '\0');
  const char* value = values->data();
  std::size_t offset = 0;
  for (const Field& field : header.fields) {
    const auto size = static_cast<std::size_t>(field.size * field.count);
    for (std::size_t i = 0; i < count; ++i, value += size)
      std::copy_n(value, size, records.data() + i * layout.stride + offset);
    offset += size;
  }
  return records;
}

Result<internal::Records> read_records(LineReader& line, std::size_t count, const Header& header,
                                       const internal::RecordLayout& layout) {
  if (header.data == "ascii") {
    auto records = ascii_points(line, count, layout);
    if (records && line.next())
      return line.fail(ErrorCode::parse, "more lines than the {} points of the header", count);
    return records;
  }
  if (header.data == "binary") {
    // Divided, not multiplied: the header may state anything.
    if (line.rest().size() / layout.stride < count)
      return fail(ErrorCode::parse, "{}: {} bytes of data, expected {} points of {} bytes", line.name(),
                  line.rest().size(), count, layout.stride);
    return binary_points(line.rest(), count, layout);
  }
  if (count == 0) return internal::Records{};
  const auto records = decompress(line.rest(), count, header, layout, line.name());
  if (!records) return tl::unexpected(records.error());
  return binary_points(*records, count, layout);
}

Result<std::pair<internal::Records, std::string>> parse_records(std::string_view bytes, const std::string& name,
                                                                bool moves) {
  LineReader line(bytes, name);
  const auto header = read_header(line);
  if (!header) return tl::unexpected(header.error());
  if (header->data != "ascii" && header->data != "binary" && header->data != "binary_compressed")
    return line.fail(ErrorCode::unsupported, "DATA is {}, expected ascii, binary or binary_compressed",
                     shown(header->data));
  auto layout = layout_of(*header, name);
  if (!layout) return tl::unexpected(layout.error());
  layout->moves = moves;
  const std::int64_t size = header->width < 0 ? header->points : header->width * header->height;
  if (size < 0) return fail(ErrorCode::parse, "{}: no POINTS or WIDTH in the header", name);
  if (header->points >= 0 && header->points != size)
    return fail(ErrorCode::parse, "{}: POINTS is {}, expected WIDTH x HEIGHT = {}", name, header->points, size);
  auto records = read_records(line, static_cast<std::size_t>(size), *header, *layout);
  if (!records) return tl::unexpected(records.error());
  return std::pair(std::move(*records), std::string(layout->time_name));
}

}  // namespace

Result<PlacedCloud> internal::parse_placed_pcd(std::string_view bytes, const std::string& name) {
  return parse_records(bytes, name, true).map([](auto&& read) {
    return PlacedCloud{{std::move(read.first.points)}, read.first.origin};
  });
}

bool is_time_field(std::string_view name) { return std::ranges::find(kTimeNames, name) != kTimeNames.end(); }

Result<TimedCloud> parse_timed_pcd(std::string_view bytes, const std::string& name) {
  return parse_records(bytes, name, false).map([](auto&& read) {
    return TimedCloud{.cloud = {std::move(read.first.points)},
                      .time_field = std::move(read.second),
                      .times = std::move(read.first.times)};
  });
}

Result<TimedCloud> read_timed_pcd(const std::string& path) {
  return read_file(path).and_then([&](const std::string& bytes) { return parse_timed_pcd(bytes, path); });
}

std::string to_pcd(std::span<const Eigen::Vector3f> points) {
  std::string out = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  for (const Eigen::Vector3f& point : points)
    for (int axis = 0; axis < 3; ++axis) internal::put(out, point[axis]);
  return out;
}

Status write_pcd(const std::string& path, std::span<const Eigen::Vector3f> points) {
  return write_file(path, to_pcd(points));
}

}  // namespace tutti::formats
