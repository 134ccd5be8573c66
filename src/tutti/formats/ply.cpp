// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/ply.hpp"

#include "tutti/base/check.hpp"
#include "tutti/formats/internal/points.hpp"

namespace tutti::formats {
namespace {

using internal::LineReader;
using internal::shown;

struct Element {
  std::string_view name;
  std::size_t count = 0;
  bool has_list = false;
  internal::RecordLayout layout;
};

struct PlyHeader {
  std::string_view format;
  std::vector<Element> elements;
};

/// Bytes of a scalar type; 0 if there is no such type.
std::size_t size_of(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
  if (type == "float" || type == "float32") return 4;
  if (type == "double" || type == "float64") return 8;
  return 0;
}

Status add_property(const LineReader& line, Element& element) {
  const auto columns = line.columns();
  if (columns.size() == 5 && columns[1] == "list") {
    element.has_list = true;
    return {};
  }
  if (auto ok = line.expect_columns(3, "property TYPE NAME"); !ok) return ok;
  const std::string_view type = columns[1];
  const std::string_view name = columns[2];
  const std::size_t size = size_of(type);
  if (size == 0) return line.fail(ErrorCode::parse, "property type is {}, expected a PLY type", shown(type));
  if (name == "x" || name == "y" || name == "z") {
    const bool is_real = type == "float" || type == "float32" || size == 8;
    if (!is_real && element.name == "vertex")
      return line.fail(ErrorCode::unsupported, "property {} is {}, expected float or double", name, type);
    element.layout.xyz[static_cast<std::size_t>(name[0] - 'x')] = {true, element.layout.stride, element.layout.columns,
                                                                   size};
  }
  element.layout.stride += size;
  ++element.layout.columns;
  return {};
}

/// Reads up to and including "end_header".
Result<PlyHeader> read_ply_header(LineReader& line) {
  PlyHeader header;
  if (!line.next() || line.columns()[0] != "ply")
    return fail(ErrorCode::parse, "{}: does not begin with \"ply\", expected a PLY file", line.name());
  while (line.next()) {
    const auto columns = line.columns();
    const std::string_view keyword = columns[0];
    if (keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "end_header") return header;
    if (keyword == "format") {
      if (auto ok = line.expect_columns(3, "format NAME 1.0"); !ok) return tl::unexpected(ok.error());
      header.format = columns[1];
    } else if (keyword == "element") {
      if (auto ok = line.expect_columns(3, "element NAME COUNT"); !ok) return tl::unexpected(ok.error());
      const auto count = line.integer(2, "count");
      if (!count) return tl::unexpected(count.error());
      if (*count < 0 || *count > internal::kMaxCount)
        return line.fail(ErrorCode::parse, "count is {}, expected 0 to {}", *count, internal::kMaxCount);
      header.elements.push_back({.name = columns[1], .count = static_cast<std::size_t>(*count)});
    } else if (keyword == "property") {
      if (header.elements.empty()) return line.fail(ErrorCode::parse, "property before any element");
      if (auto ok = add_property(line, header.elements.back()); !ok) return tl::unexpected(ok.error());
    } else {
      return line.fail(ErrorCode::parse, "header keyword is {}, expected one of PLY 1.0", shown(keyword));
    }
  }
  return fail(ErrorCode::parse, "{}: no end_header line", line.name());
}

Status skip(LineReader& line, std::string_view& data, bool ascii, const Element& element) {
  if (element.has_list)
    return fail(ErrorCode::unsupported, "{}: lists in or before the vertices (element {}), expected plain numbers",
                line.name(), shown(element.name));
  if (!ascii) {
    if (element.layout.stride > 0 && data.size() / element.layout.stride < element.count)
      return fail(ErrorCode::parse, "{}: ends within element {}", line.name(), shown(element.name));
    data.remove_prefix(element.count * element.layout.stride);
    return {};
  }
  for (std::size_t i = 0; i < element.count; ++i)
    if (!line.next()) return fail(ErrorCode::parse, "{}: ends within element {}", line.name(), shown(element.name));
  return {};
}

}  // namespace

namespace {

Result<PlacedCloud> parse_vertices(std::string_view bytes, const std::string& name, bool moves) {
  LineReader line(bytes, name);
  const auto header = read_ply_header(line);
  if (!header) return tl::unexpected(header.error());
  const bool ascii = header->format == "ascii";
  if (!ascii && header->format != "binary_little_endian")
    return fail(ErrorCode::unsupported, "{}: format is {}, expected ascii or binary_little_endian", name,
                shown(header->format));

  std::string_view data = line.rest();
  for (const Element& element : header->elements) {
    if (element.name != "vertex") {
      if (auto ok = skip(line, data, ascii, element); !ok) return tl::unexpected(ok.error());
      continue;
    }
    if (element.has_list) return fail(ErrorCode::unsupported, "{}: vertices hold lists, expected plain numbers", name);
    auto layout = element.layout;
    layout.moves = moves;
    for (const auto& coordinate : layout.xyz)
      if (!coordinate.found)
        return fail(ErrorCode::parse, "{}: vertex properties x, y and z expected, at least one is not there", name);
    if (ascii) {
      auto records = ascii_points(line, element.count, layout);
      if (!records) return tl::unexpected(records.error());
      return PlacedCloud{{std::move(records->points)}, records->origin};
    }
    if (data.size() / layout.stride < element.count)
      return fail(ErrorCode::parse, "{}: {} bytes of data, expected {} vertices of {} bytes", name, data.size(),
                  element.count, layout.stride);
    auto records = binary_points(data, element.count, layout);
    return PlacedCloud{{std::move(records.points)}, records.origin};
  }
  return fail(ErrorCode::parse, "{}: no element vertex in the header", name);
}

}  // namespace

Result<PointCloud> parse_ply(std::string_view bytes, const std::string& name) {
  return parse_vertices(bytes, name, false).map([](PlacedCloud&& placed) { return std::move(placed.cloud); });
}

Result<PlacedCloud> parse_placed_ply(std::string_view bytes, const std::string& name) {
  return parse_vertices(bytes, name, true);
}

Result<PointCloud> read_ply(const std::string& path) {
  return read_file(path).and_then([&](const std::string& bytes) { return parse_ply(bytes, path); });
}

std::string to_ply(std::span<const Eigen::Vector3f> points, std::span<const Rgb> colours,
                   std::span<const Triangle> triangles, std::span<const std::string> comments) {
  TUTTI_CHECK(colours.empty() || colours.size() == points.size(), "{} colours for {} points", colours.size(),
              points.size());
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) out += "comment " + comment + "\n";
  out += fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n", points.size());
  if (!colours.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!triangles.empty())
    out += fmt::format("element face {}\nproperty list uchar int vertex_indices\n", triangles.size());
  out += "end_header\n";
  out.reserve(out.size() + points.size() * (colours.empty() ? 12 : 15) + triangles.size() * 13);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) internal::put(out, points[i][axis]);
    if (colours.empty()) continue;
    for (const std::uint8_t channel : {colours[i].red, colours[i].green, colours[i].blue}) internal::put(out, channel);
  }
  for (const Triangle& corners : triangles) {
    internal::put(out, std::uint8_t{3});
    for (const std::uint32_t corner : corners) {
      TUTTI_CHECK(corner < points.size(), "corner {} of {} vertices", corner, points.size());
      internal::put(out, corner);
    }
  }
  return out;
}

Status write_ply(const std::string& path, std::span<const Eigen::Vector3f> points, std::span<const Rgb> colours,
                 std::span<const Triangle> triangles, std::span<const std::string> comments) {
  return write_file(path, to_ply(points, colours, triangles, comments));
}

}  // namespace tutti::formats
