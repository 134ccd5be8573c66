// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/fleet_graph.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "tutti/base/file_kind.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/jrl.hpp"
#include "tutti/formats/symbol_keys.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::formats {
namespace {

/// The covariance to a positive semidefinite information; a direction that is not determined has a variance of 1e9 of
/// the smallest.
Matrix6d covariance_of(const Matrix6d& information) {
  constexpr double kLeastShare = 1e-9;
  const Eigen6 eigen = eigen_of(information);
  const Vector6d values = eigen.values.cwiseMax(kLeastShare * eigen.values(5));
  const Matrix6d out = eigen.vectors * values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  return 0.5 * (out + out.transpose());
}

/// Robots by letters, or by gaps; numbers count along each robot, so that neighbours have consecutive ones.
Result<std::vector<PyfgName>> names_of(const G2oFile& graph, const std::string& name) {
  constexpr char kFirst = 'a', kLast = 'z';
  const bool has_letters = std::ranges::all_of(graph.vertex_ids, [](auto id) { return letter_of(id).has_value(); });
  const std::vector<bool> joined = joined_to_previous(graph);
  std::vector<PyfgName> out;
  for (std::size_t v = 0; v < graph.vertex_ids.size(); ++v) {
    const char letter = has_letters ? *letter_of(graph.vertex_ids[v])
                        : v == 0    ? kFirst
                        : joined[v] ? out.back().robot
                                    : static_cast<char>(out.back().robot + 1);
    if (!has_letters && letter > kLast)
      return fail(ErrorCode::unsupported,
                  "{}: more than 26 vertices have no edge to the one before: expected odometry along increasing ids",
                  name);
    const bool goes_on = v > 0 && out.back().robot == letter;
    out.push_back({letter, goes_on ? out.back().number + 1 : 0});
  }
  return out;
}

Result<PyfgFile> with_stamps(PyfgFile file, const G2oFile& graph, const std::string& path) {
  const std::string beside = stamps_beside(path);
  std::error_code unreadable;
  if (!std::filesystem::exists(beside, unreadable)) return file;
  const auto read = read_graph_stamps(beside);
  if (!read) return tl::unexpected(read.error());
  const auto rows = rows_of(graph.vertex_ids, *read, beside, path);
  if (!rows) return tl::unexpected(rows.error());
  for (std::size_t v = 0; v < rows->size(); ++v) file.vertices[v].stamp = (*rows)[v].stamp;
  for (PyfgEdge& edge : file.edges) edge.stamp = file.vertices[std::max(edge.from, edge.to)].stamp;
  file.stamps_from = "of " + std::filesystem::path(beside).filename().string();
  return file;
}

}  // namespace

Result<PyfgFile> as_fleet(const G2oFile& graph, const std::string& name) {
  const auto names = names_of(graph, name);
  if (!names) return tl::unexpected(names.error());
  PyfgFile out{.indefinite = graph.indefinite_edges, .stamps_from = kCountedSeconds};
  for (const PyfgName& vertex : *names)
    out.vertices.push_back({.name = vertex, .stamp = Timestamp{} + static_cast<double>(vertex.number)});
  for (const PoseGraphEdge& edge : graph.graph.edges)
    out.edges.push_back({std::max(out.vertices[edge.from].stamp, out.vertices[edge.to].stamp),
                         edge.from,
                         edge.to,
                         {edge.T_from_to, covariance_of(edge.information)}});
  return out;
}

Result<PyfgFile> read_fleet_graph(const std::string& path) {
  const auto text = read_file_for(FileUse::graph, path);
  if (!text) return tl::unexpected(text.error());
  if (looks_like_jrl(*text)) return parse_jrl(*text, path);
  if (looks_like_pyfg(*text)) return parse_pyfg(*text, path);
  const auto graph = parse_g2o_edges(*text, path);
  if (!graph) return tl::unexpected(graph.error());
  auto fleet = as_fleet(*graph, path);
  return fleet ? with_stamps(std::move(*fleet), *graph, path) : fleet;
}

}  // namespace tutti::formats
