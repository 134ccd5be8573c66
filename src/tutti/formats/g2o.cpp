// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/g2o.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/file_kind.hpp"
#include "tutti/formats/internal/chain.hpp"
#include "tutti/formats/internal/foreign_text.hpp"
#include "tutti/formats/internal/g2o_lines.hpp"
#include "tutti/formats/symbol_keys.hpp"

namespace tutti::formats {
namespace {

using internal::G2oEdge;
using internal::G2oLines;
using internal::G2oVertex;
using internal::kPlanarAxes;

/// The vertices by id, each once; an error when one comes twice with different poses.
Result<std::map<std::int64_t, const G2oVertex*>> index_vertices(const G2oLines& lines) {
  std::map<std::int64_t, const G2oVertex*> out;
  for (const G2oVertex& vertex : lines.vertices) {
    const auto [at, is_new] = out.try_emplace(vertex.id, &vertex);
    if (!is_new && !(at->second->pose == vertex.pose))
      return fail(ErrorCode::invalid,
                  "{}: vertex {} is at {} already, with another pose: expected ids of their own in each file",
                  vertex.where, vertex_name(vertex.id), at->second->where);
  }
  return out;
}

std::vector<std::int64_t> collect_ids(const G2oLines& lines, const std::map<std::int64_t, const G2oVertex*>& vertices) {
  std::set<std::int64_t> ids;
  for (const auto& [id, vertex] : vertices) ids.insert(id);
  if (vertices.empty())
    for (const G2oEdge& edge : lines.edges) ids.insert({edge.from, edge.to});
  return {ids.begin(), ids.end()};
}

/// Ids to positions in `ids`.
class Positions {
 public:
  explicit Positions(const std::vector<std::int64_t>& ids) : ids_(ids) {}
  [[nodiscard]] Result<std::size_t> of(std::int64_t id, const std::string& where) const {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
    if (found != ids_.end() && *found == id) return static_cast<std::size_t>(found - ids_.begin());
    const auto letter = letter_of(id);
    const bool has_robot = letter && std::ranges::any_of(ids_, [&](auto other) { return letter_of(other) == letter; });
    return fail(ErrorCode::invalid, "{}: names vertex {}, which is not in the file{}", where, vertex_name(id),
                letter && !has_robot
                    ? fmt::format("; give the file that has robot {}, too: several files are one graph", *letter)
                    : "");
  }

 private:
  const std::vector<std::int64_t>& ids_;
};

bool is_same(const PoseGraphEdge& a, const PoseGraphEdge& b) {
  return a.T_from_to == b.T_from_to && a.information == b.information;
}

/// Leads edges to their vertices; one that is there twice to the digit counts once.
Status add_edges(const G2oLines& lines, const Positions& positions, G2oFile& file) {
  std::multimap<std::pair<std::size_t, std::size_t>, std::size_t> known;
  file.graph.edges.reserve(lines.edges.size());
  for (const G2oEdge& edge : lines.edges) {
    const auto from = positions.of(edge.from, edge.where + ": edge");
    if (!from) return tl::unexpected(from.error());
    const auto to = positions.of(edge.to, edge.where + ": edge");
    if (!to) return tl::unexpected(to.error());
    const PoseGraphEdge read{*from, *to, edge.T_from_to, edge.information};
    const auto [begin, end] = known.equal_range({*from, *to});
    if (std::any_of(begin, end, [&](const auto& k) { return is_same(file.graph.edges[k.second], read); })) {
      ++file.repeated_edges;
      continue;
    }
    known.emplace(std::pair(*from, *to), file.graph.edges.size());
    file.graph.edges.push_back(read);
  }
  return {};
}

std::string tags_of(const G2oLines& lines) {
  return lines.left_out.empty() ? "" : fmt::format("; lines of other kinds: {}", counted(lines.left_out));
}

/// Without vertices, poses are the identity.
Result<G2oFile> assemble(const G2oLines& lines, const std::string& name) {
  const auto vertices = index_vertices(lines);
  if (!vertices) return tl::unexpected(vertices.error());
  G2oFile file;
  file.vertex_ids = collect_ids(lines, *vertices);
  if (file.vertex_ids.empty())
    return fail(ErrorCode::parse, "{}: no vertex and no edge, expected a pose graph{}", name, tags_of(lines));
  file.has_vertices = !vertices->empty();
  file.is_2d = lines.has_2d;
  file.indefinite_edges = lines.indefinite_edges;
  file.worst_indefinite_share = lines.worst_indefinite_share;
  file.left_out = lines.left_out;
  const Positions positions(file.vertex_ids);
  for (const std::int64_t id : lines.fixed) {
    const auto found = positions.of(id, name + ": FIX");
    const bool leaves_vertices =
        std::ranges::any_of(lines.left_out, [](const auto& entry) { return entry.first.starts_with("VERTEX"); });
    if (!found && leaves_vertices) {  // a landmark, mostly
      ++file.left_out["FIX"];
      continue;
    }
    if (!found) return tl::unexpected(found.error());
    file.fixed.push_back(*found);
  }
  std::sort(file.fixed.begin(), file.fixed.end());
  file.fixed.erase(std::unique(file.fixed.begin(), file.fixed.end()), file.fixed.end());
  if (auto ok = add_edges(lines, positions, file); !ok) return tl::unexpected(ok.error());
  file.graph.poses.resize(file.vertex_ids.size());
  for (const auto& [id, vertex] : *vertices) file.graph.poses[*positions.of(id, name)] = vertex->pose;
  return file;
}

/// With line ends and decimal points as here; UTF-16 is an error that says what to type.
Result<std::string> read_text(const std::string& path) {
  return read_file_for(FileUse::graph, path).and_then([&](std::string text) {
    return internal::plain_text(std::move(text), path);
  });
}

Status place_along_edges(G2oFile& file, const std::string& name) {
  const std::size_t components = internal::chain_poses(file.graph, file.vertex_ids);
  if (components != 1)
    return fail(ErrorCode::invalid, "{}: no VERTEX lines and {} connected components, expected 1 to chain poses in",
                name, components);
  for (std::size_t i = 0; i < file.graph.poses.size(); ++i)
    if (!file.graph.poses[i].translation.allFinite())
      return fail(ErrorCode::invalid, "{}: position of vertex {}, chained from the edges, is not finite", name,
                  vertex_name(file.vertex_ids[i]));
  return {};
}

void write_pose(std::string& out, const Pose3& pose, bool is_2d) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  if (is_2d)
    fmt::format_to(std::back_inserter(out), " {} {} {}", t.x(), t.y(), 2.0 * std::atan2(q.z(), q.w()));
  else
    fmt::format_to(std::back_inserter(out), " {} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write_information(std::string& out, const Matrix6d& information, bool is_2d) {
  static constexpr std::array<int, 6> kAllAxes = {0, 1, 2, 3, 4, 5};
  const std::span<const int> axes = is_2d ? std::span<const int>(kPlanarAxes) : std::span<const int>(kAllAxes);
  for (std::size_t row = 0; row < axes.size(); ++row)
    for (std::size_t column = row; column < axes.size(); ++column)
      fmt::format_to(std::back_inserter(out), " {}", information(axes[row], axes[column]));
}

}  // namespace

std::string counted(const std::map<std::string, std::size_t>& left_out) {
  std::string out;
  for (const auto& [tag, count] : left_out) out += fmt::format("{}{} x {}", out.empty() ? "" : ", ", count, tag);
  return out;
}

std::vector<bool> joined_to_previous(const G2oFile& graph) {
  std::vector<bool> out(graph.vertex_ids.size(), false);
  for (const PoseGraphEdge& edge : graph.graph.edges)
    if (const auto [a, b] = std::minmax(edge.from, edge.to); b == a + 1) out[b] = true;
  return out;
}

Result<G2oFile> parse_g2o_edges(std::string_view text, const std::string& name) {
  G2oLines lines;
  if (auto ok = internal::read_g2o_lines(text, name, lines); !ok) return tl::unexpected(ok.error());
  return assemble(lines, name);
}

Result<G2oFile> parse_g2o(std::string_view text, const std::string& name) {
  auto file = parse_g2o_edges(text, name);
  if (!file || file->has_vertices) return file;
  if (auto ok = place_along_edges(*file, name); !ok) return tl::unexpected(ok.error());
  return file;
}

Result<G2oFile> read_g2o_edges(const std::string& path) {
  return read_text(path).and_then([&](const std::string& text) { return parse_g2o_edges(text, path); });
}

Result<G2oFile> read_g2o(std::span<const std::string> paths) {
  G2oLines lines;
  for (const std::string& path : paths) {
    const auto text = read_text(path);
    if (!text) return tl::unexpected(text.error());
    if (auto ok = internal::read_g2o_lines(*text, path, lines); !ok) return tl::unexpected(ok.error());
  }
  const std::string name = fmt::format("{}", fmt::join(paths, " + "));
  auto file = assemble(lines, name);
  if (!file || file->has_vertices) return file;
  if (auto ok = place_along_edges(*file, name); !ok) return tl::unexpected(ok.error());
  return file;
}

Result<G2oFile> read_g2o(const std::string& path) { return read_g2o(std::span(&path, 1)); }

std::string to_g2o(const G2oFile& file) {
  const auto& [poses, edges] = file.graph;
  TUTTI_CHECK(file.vertex_ids.size() == poses.size(), "{} ids for {} poses", file.vertex_ids.size(), poses.size());
  std::string out;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{} {}", file.is_2d ? "VERTEX_SE2" : "VERTEX_SE3:QUAT", file.vertex_ids[i]);
    write_pose(out, poses[i], file.is_2d);
    out += '\n';
  }
  for (const std::size_t i : file.fixed) fmt::format_to(std::back_inserter(out), "FIX {}\n", file.vertex_ids.at(i));
  for (const PoseGraphEdge& edge : edges) {
    fmt::format_to(std::back_inserter(out), "{} {} {}", file.is_2d ? "EDGE_SE2" : "EDGE_SE3:QUAT",
                   file.vertex_ids.at(edge.from), file.vertex_ids.at(edge.to));
    write_pose(out, edge.T_from_to, file.is_2d);
    write_information(out, edge.information, file.is_2d);
    out += '\n';
  }
  return out;
}

Status write_g2o(const std::string& path, const G2oFile& file) { return write_file(path, to_g2o(file)); }

Status write_g2o(const std::string& path, const PoseGraph& graph) {
  G2oFile file{.graph = graph, .vertex_ids = std::vector<std::int64_t>(graph.poses.size())};
  std::iota(file.vertex_ids.begin(), file.vertex_ids.end(), 0);
  return write_g2o(path, file);
}

}  // namespace tutti::formats
