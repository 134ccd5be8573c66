// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/pyfg.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>

#include "tutti/base/file.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/internal/semidefinite.hpp"
#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {
namespace {

using internal::LineReader;
using internal::shown;

constexpr std::string_view kVertex = "VERTEX_SE3:QUAT", kPrior = "VERTEX_SE3:QUAT:PRIOR", kEdge = "EDGE_SE3:QUAT";
constexpr double kPriorVariance = 1e-6;

/// An edge or a prior (no `to`) between names; vertices may come after them.
struct PyfgLine {
  PyfgName from;
  std::optional<PyfgName> to;
  Timestamp stamp;
  RelativePose measurement;
  int line = 0;
};
struct PyfgLines {
  std::vector<PyfgVertex> vertices;
  std::vector<PyfgLine> others;
  std::size_t indefinite = 0;
};

constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

Result<PyfgName> read_name(const LineReader& line, std::size_t column) {
  const std::string_view text = line.columns()[column];
  const auto number = text.empty() ? std::nullopt : internal::parse_integer(text.substr(1));
  if (!number || *number < 0 || !is_letter(text.front()) || text[1] == '+')
    return line.fail(ErrorCode::parse, "name in column {} is {}, expected a letter and a number, as A12", column + 1,
                     shown(text));
  return PyfgName{text.front(), static_cast<std::uint64_t>(*number)};
}

Result<Timestamp> read_stamp(const LineReader& line) {
  const auto stamp = internal::parse_seconds(line.columns()[1]);
  if (!stamp)
    return line.fail(ErrorCode::parse, "stamp is {}, expected seconds between the years 1896 and 2043",
                     shown(line.columns()[1]));
  return *stamp;
}

Result<Pose3> read_pose(const LineReader& line, std::size_t first) {
  std::array<double, 7> v{};
  if (auto ok = line.numbers(first, v); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_position(line, {v[0], v[1], v[2]}); !ok) return tl::unexpected(ok.error());
  const auto q = internal::to_unit(line, {v[6], v[3], v[4], v[5]});
  if (!q) return tl::unexpected(q.error());
  return Pose3{*q, {v[0], v[1], v[2]}};
}

Result<Matrix6d> read_covariance(const LineReader& line, std::size_t first, std::size_t& indefinite) {
  std::array<double, 21> upper{};
  if (auto ok = line.numbers(first, upper); !ok) return tl::unexpected(ok.error());
  Matrix6d out;
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) out(row, column) = out(column, row) = upper[next++];
  auto nearest = internal::nearest_semidefinite(out);
  if (!nearest) return line.fail(nearest.error().code, "{}", nearest.error().message);
  if (nearest->is_replaced) ++indefinite;
  return nearest->covariance;
}

Status read_pyfg_line(const LineReader& line, PyfgLines& lines) {
  const std::string_view tag = line.columns()[0];
  const bool is_vertex = tag == kVertex, is_edge = tag == kEdge;
  if (!is_vertex && !is_edge && tag != kPrior)
    return line.fail(ErrorCode::unsupported, "tag is {}, expected {}, {} or {}", shown(tag), kVertex, kPrior, kEdge);
  const auto layout = is_vertex ? "stamp name, 7 of the pose"
                      : is_edge ? "stamp from to, 7 of the pose, 21 of the covariance"
                                : "stamp name, 7 of the pose, 21 of the covariance";
  if (auto ok = line.expect_columns(is_vertex ? 10 : is_edge ? 32 : 31, fmt::format("{} {}", tag, layout)); !ok)
    return ok;
  const auto stamp = read_stamp(line);
  if (!stamp) return tl::unexpected(stamp.error());
  const auto name = read_name(line, 2);
  if (!name) return tl::unexpected(name.error());
  const std::size_t numbers = is_edge ? 4 : 3;
  const auto pose = read_pose(line, numbers);
  if (!pose) return tl::unexpected(pose.error());
  if (is_vertex) {
    lines.vertices.push_back({*name, *stamp, *pose, {}});
    return {};
  }
  const auto covariance = read_covariance(line, numbers + 7, lines.indefinite);
  if (!covariance) return tl::unexpected(covariance.error());
  PyfgLine& read = lines.others.emplace_back(PyfgLine{*name, {}, *stamp, {*pose, *covariance}, line.line()});
  if (!is_edge) return {};
  const auto to = read_name(line, 3);
  if (!to) return tl::unexpected(to.error());
  if (*to == *name) return line.fail(ErrorCode::invalid, "edge from vertex {} to itself", to_string(*name));
  read.to = *to;
  return {};
}

/// The vertices of a file that lists none: those that odometry joins.
std::vector<PyfgVertex> vertices_of_odometry(const std::vector<PyfgLine>& lines) {
  std::set<PyfgName> names;
  for (const PyfgLine& line : lines)
    if (line.to && is_odometry(line.from, *line.to)) names.insert({line.from, *line.to});
  std::vector<PyfgVertex> out;
  for (const PyfgName& name : names) out.push_back({.name = name, .stamp = {}, .pose = {}, .prior = {}});
  return out;
}

Result<PyfgFile> assemble_pyfg(PyfgLines lines, const std::string& name) {
  PyfgFile file{.vertices = std::move(lines.vertices), .edges = {}, .indefinite = lines.indefinite};
  if (file.vertices.empty()) file.vertices = vertices_of_odometry(lines.others);
  if (file.vertices.empty())
    return fail(ErrorCode::parse, "{}: no {} line, and no {} from a vertex to the next: expected a pose graph", name,
                kVertex, kEdge);
  std::ranges::sort(file.vertices, {}, &PyfgVertex::name);
  const auto twice = std::ranges::adjacent_find(file.vertices, {}, &PyfgVertex::name);
  if (twice != file.vertices.end())
    return fail(ErrorCode::invalid, "{}: vertex {} comes twice", name, to_string(twice->name));
  for (const PyfgLine& line : lines.others) {
    std::array<std::size_t, 2> ends{};
    for (std::size_t end = 0; end < (line.to ? 2U : 1U); ++end) {
      const PyfgName& of = end == 0 ? line.from : *line.to;
      const auto found = std::ranges::lower_bound(file.vertices, of, {}, &PyfgVertex::name);
      if (found == file.vertices.end() || found->name != of)
        return fail(ErrorCode::invalid, "{}:{}: names vertex {}, which is not in the file", name, line.line,
                    to_string(of));
      ends[end] = static_cast<std::size_t>(found - file.vertices.begin());
    }
    if (line.to)
      file.edges.push_back({line.stamp, ends[0], ends[1], line.measurement});
    else
      file.vertices[ends[0]].prior = line.measurement.T_a_b;
  }
  return file;
}

void write_pose(std::string& out, const Pose3& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  fmt::format_to(std::back_inserter(out), " {} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write_covariance(std::string& out, const Matrix6d& covariance) {
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      fmt::format_to(std::back_inserter(out), " {}", covariance(row, column));
  out += '\n';
}

}  // namespace

bool is_odometry(const PyfgName& a, const PyfgName& b) {
  return a.robot == b.robot && (a.number + 1 == b.number || b.number + 1 == a.number);
}

std::string to_string(const PyfgName& name) { return fmt::format("{}{}", name.robot, name.number); }

Result<PyfgFile> parse_pyfg(std::string_view text, const std::string& name) {
  LineReader line(text, name);
  PyfgLines lines;
  while (line.next())
    if (auto ok = read_pyfg_line(line, lines); !ok) return tl::unexpected(ok.error());
  return assemble_pyfg(std::move(lines), name);
}

Result<PyfgFile> read_pyfg(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_pyfg(text, path); });
}

bool looks_like_pyfg(std::string_view text) {
  LineReader line(text, {});
  return line.next() && line.columns().size() > 2 && !line.columns()[2].empty() && is_letter(line.columns()[2].front());
}

std::string to_pyfg(const PyfgFile& file) {
  std::string out;
  const auto begin = [&](std::string_view tag, Timestamp stamp, const PyfgName& name) {
    fmt::format_to(std::back_inserter(out), "{} {} {}", tag, internal::to_seconds(stamp), to_string(name));
  };
  for (const PyfgVertex& vertex : file.vertices) {
    if (!vertex.pose) continue;
    begin(kVertex, vertex.stamp, vertex.name);
    write_pose(out, *vertex.pose);
    out += '\n';
  }
  for (const PyfgVertex& vertex : file.vertices) {
    if (!vertex.prior) continue;
    begin(kPrior, vertex.stamp, vertex.name);
    write_pose(out, *vertex.prior);
    write_covariance(out, kPriorVariance * Matrix6d::Identity());
  }
  for (const PyfgEdge& edge : file.edges) {
    begin(kEdge, edge.stamp, file.vertices.at(edge.from).name);
    fmt::format_to(std::back_inserter(out), " {}", to_string(file.vertices.at(edge.to).name));
    write_pose(out, edge.measurement.T_a_b);
    write_covariance(out, edge.measurement.covariance);
  }
  return out;
}

std::optional<PyfgTimes> times_of(const PyfgFile& file) {
  const auto& vertices = file.vertices;
  PyfgTimes out{.stamps = {}, .from = file.stamps_from};
  std::vector<std::uint32_t> robots;
  for (const PyfgVertex& vertex : vertices) {
    robots.push_back(static_cast<std::uint32_t>(vertex.name.robot));
    out.stamps.push_back(vertex.stamp);
  }
  if (are_times(robots, out.stamps)) return out;
  std::vector<std::optional<Timestamp>> ends(vertices.size());
  for (const PyfgEdge& edge : file.edges) {
    const auto [a, b] = std::minmax(edge.from, edge.to);
    if (b == a + 1 && robots[a] == robots[b] && !ends[b]) ends[b] = edge.stamp;
  }
  std::vector<Timestamp> known;
  for (const auto& end : ends)
    if (end) known.push_back(*end);
  const double gap_s = typical_gap_s(known);
  for (std::size_t v = 0; v + 1 < vertices.size(); ++v)
    if ((v == 0 || robots[v] != robots[v - 1]) && ends[v + 1]) ends[v] = *ends[v + 1] - gap_s;
  out.from = "of the odometry edges, as of their later poses";
  if (!std::ranges::all_of(ends, [](const auto& end) { return end.has_value(); })) return std::nullopt;
  for (std::size_t v = 0; v < vertices.size(); ++v) out.stamps[v] = *ends[v];
  return are_times(robots, out.stamps) ? std::optional(std::move(out)) : std::nullopt;
}

Status write_pyfg(const std::string& path, const PyfgFile& file) { return write_file(path, to_pyfg(file)); }

}  // namespace tutti::formats
