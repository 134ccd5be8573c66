// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/graph_stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>

#include "tutti/base/file.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/symbol_keys.hpp"

namespace tutti::formats {
namespace {

constexpr std::string_view kLayout = "id,robot,keyframe,stamp_ns";

Result<std::uint32_t> small_number(const internal::LineReader& line, std::size_t column, std::string_view what) {
  const auto value = line.integer(column, what);
  if (!value) return tl::unexpected(value.error());
  if (*value < 0 || *value > std::numeric_limits<std::uint32_t>::max())
    return line.fail(ErrorCode::invalid, "{} is {}, expected 0 to 2^32 - 1", what, *value);
  return static_cast<std::uint32_t>(*value);
}

}  // namespace

bool are_times(std::span<const std::uint32_t> robots, std::span<const Timestamp> stamps) {
  constexpr double kLeastGap_s = 1e-3;
  std::vector<double> gaps;
  for (std::size_t v = 1; v < robots.size(); ++v) {
    if (robots[v] != robots[v - 1]) continue;
    if (stamps[v] <= stamps[v - 1]) return false;
    gaps.push_back(stamps[v] - stamps[v - 1]);
  }
  if (gaps.empty()) return true;
  std::ranges::nth_element(gaps, gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2));
  return gaps[gaps.size() / 2] >= kLeastGap_s;
}

std::string stamps_beside(const std::string& graph_path) {
  std::filesystem::path path(graph_path);
  path.replace_filename(path.stem().string() + "_stamps.csv");
  return path.string();
}

Result<std::vector<VertexStamp>> parse_graph_stamps(std::string_view text, const std::string& name) {
  internal::LineReader line(text, name, internal::Separator::comma);
  std::vector<VertexStamp> out;
  for (bool first = true; line.next(); first = false) {
    if (auto ok = line.expect_columns(4, kLayout); !ok) return tl::unexpected(ok.error());
    if (first && line.columns()[0] == "id") continue;
    const auto id = line.integer(0, "id");
    const auto robot = small_number(line, 1, "robot");
    const auto keyframe = small_number(line, 2, "keyframe");
    const auto stamp_ns = line.integer(3, "stamp_ns");
    if (!id) return tl::unexpected(id.error());
    if (!robot) return tl::unexpected(robot.error());
    if (!keyframe) return tl::unexpected(keyframe.error());
    if (!stamp_ns) return tl::unexpected(stamp_ns.error());
    if (!internal::is_in_range({*stamp_ns}))
      return line.fail(ErrorCode::invalid, "stamp_ns is {}, expected at most 2^61 either way", *stamp_ns);
    out.push_back({*id, {RobotId{*robot}, *keyframe}, {*stamp_ns}});
  }
  return out;
}

Result<std::vector<VertexStamp>> read_graph_stamps(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_graph_stamps(text, path); });
}

Result<std::vector<VertexStamp>> rows_of(std::span<const std::int64_t> vertex_ids, std::span<const VertexStamp> rows,
                                         const std::string& path, const std::string& graph) {
  std::map<std::int64_t, VertexStamp> by_id;
  for (const VertexStamp& row : rows) by_id[row.vertex_id] = row;
  std::vector<VertexStamp> out;
  for (const std::int64_t id : vertex_ids) {
    const auto found = by_id.find(id);
    if (found == by_id.end())
      return fail(ErrorCode::invalid, "{}: has no line for vertex {} of {}", path, vertex_name(id), graph);
    out.push_back(found->second);
  }
  return out;
}

Status write_graph_stamps(const std::string& path, std::span<const VertexStamp> stamps) {
  std::string csv(kLayout);
  csv += '\n';
  for (const VertexStamp& stamp : stamps)
    fmt::format_to(std::back_inserter(csv), "{},{},{},{}\n", stamp.vertex_id, stamp.keyframe.chain.robot.value,
                   stamp.keyframe.index, stamp.stamp.ns);
  return write_file(path, csv);
}

}  // namespace tutti::formats
