// SPDX-License-Identifier: BSD-3-Clause
#include "graph_input.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <tuple>

#include "tutti/base/file_kind.hpp"
#include "tutti/formats/fleet_graph.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/jrl.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/formats/symbol_keys.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/patience.hpp"

namespace tutti::app {
namespace {

/// A vertex before it has its place: by robot, then by `order`.
struct Loose {
  std::uint32_t robot = 0;
  std::int64_t order = 0;
  std::size_t position = 0;  ///< In the file's graph.
};

bool is_a_file(const std::string& path) {
  std::error_code unreadable;
  return std::filesystem::exists(path, unreadable);
}

/// Or JRL: a file whose vertices have names.
Result<bool> is_pyfg(const std::string& path) {
  if (const auto ending = std::filesystem::path(path).extension(); ending == ".g2o") return false;
  const auto text = read_file_for(FileUse::graph, path);
  if (!text) return tl::unexpected(text.error());
  return formats::looks_like_pyfg(*text) || formats::looks_like_jrl(*text);
}

/// Puts vertices and edges of `graph` in their order; robots are numbered in the order of `loose`.
void place(const PoseGraph& graph, std::vector<Loose> loose, NamedGraph& out) {
  std::ranges::sort(loose, {}, [](const Loose& v) { return std::tuple(v.robot, v.order, v.position); });
  std::vector<std::size_t> place_of(loose.size());
  std::uint32_t index = 0;
  for (std::size_t v = 0; v < loose.size(); ++v) {
    index = v > 0 && loose[v].robot == loose[v - 1].robot ? index + 1 : 0;
    out.robots.vertices.push_back({RobotId{loose[v].robot}, index});
    out.robots.graph.poses.push_back(graph.poses[loose[v].position]);
    place_of[loose[v].position] = v;
  }
  out.robots.graph.edges = graph.edges;
  for (PoseGraphEdge& edge : out.robots.graph.edges) {
    edge.from = place_of[edge.from];
    edge.to = place_of[edge.to];
  }
}

/// For vertices that are in their places.
bool are_times(const NamedGraph& graph) {
  std::vector<std::uint32_t> robots;
  for (const KeyframeId& id : graph.robots.vertices) robots.push_back(id.chain.robot.value);
  return formats::are_times(robots, graph.robots.stamps);
}

void count_seconds(NamedGraph& graph) {
  graph.robots.stamps.clear();
  for (const KeyframeId& id : graph.robots.vertices) graph.robots.stamps.push_back(Timestamp{} + id.index);
  graph.stamps_from = formats::kCountedSeconds;
}

Result<NamedGraph> from_pyfg(const GraphSource& source) {
  if (!source.robots.empty())
    return fail(ErrorCode::configuration, "--robots: {} names its robots by letters", source.path);
  const auto file = formats::read_fleet_graph(source.path);
  if (!file) return tl::unexpected(file.error());
  NamedGraph out{.is_pyfg = true, .replaced = file->indefinite, .robots_from = "letters of the names"};
  PoseGraph graph;
  std::vector<Loose> loose;
  for (const auto& vertex : file->vertices) {
    if (loose.empty() || out.robot_names.back().front() != vertex.name.robot)
      out.robot_names.emplace_back(1, vertex.name.robot);
    loose.push_back({static_cast<std::uint32_t>(out.robot_names.size() - 1),
                     static_cast<std::int64_t>(vertex.name.number), loose.size()});
    graph.poses.push_back(vertex.pose.value_or(Pose3{}));
    out.has_poses = out.has_poses && vertex.pose.has_value();
    out.names.push_back(to_string(vertex.name));
    out.ids.push_back((std::int64_t{vertex.name.robot} << formats::kSymbolShift) |
                      static_cast<std::int64_t>(vertex.name.number));
    out.fixed_poses.push_back(vertex.prior);
  }
  for (const auto& edge : file->edges)
    graph.edges.push_back(
        {edge.from, edge.to, edge.measurement.T_a_b, inverse_of(invertible_covariance(edge.measurement.covariance))});
  place(graph, std::move(loose), out);
  if (auto times = formats::times_of(*file)) {
    out.robots.stamps = std::move(times->stamps);
    out.stamps_from = std::move(times->from);
  } else {
    count_seconds(out);
  }
  return out;
}

/// The robots of ascending ids: which robot each vertex is of, and what they are called.
struct Robots {
  std::vector<std::uint32_t> of;
  std::vector<std::string> names;
};

Result<Robots> robots_by_ranges(const GraphSource& source, const formats::G2oFile& file) {
  if (!std::ranges::is_sorted(source.robots, std::less_equal<>()))
    return fail(ErrorCode::configuration, "--robots: {} do not increase, expected each robot's first vertex",
                fmt::join(source.robots, ","));
  if (file.vertex_ids.front() < source.robots.front())
    return fail(ErrorCode::configuration, "--robots: vertex {} comes before the first robot's {}",
                file.vertex_ids.front(), source.robots.front());
  Robots out;
  for (const std::int64_t id : file.vertex_ids)
    out.of.push_back(
        static_cast<std::uint32_t>(std::ranges::upper_bound(source.robots, id) - source.robots.begin() - 1));
  for (std::size_t r = 0; r < source.robots.size(); ++r) out.names.push_back(fmt::format("{}", r));
  return out;
}

Robots robots_by_letters(const formats::G2oFile& file) {
  Robots out;
  for (const std::int64_t id : file.vertex_ids) {
    const std::string name(1, *formats::letter_of(id));
    if (out.names.empty() || out.names.back() != name) out.names.push_back(name);
    out.of.push_back(static_cast<std::uint32_t>(out.names.size() - 1));
  }
  return out;
}

Result<Robots> robots_by_gaps(const GraphSource& source, const formats::G2oFile& file) {
  const std::vector<bool> joined = formats::joined_to_previous(file);
  Robots out;
  for (std::size_t v = 0; v < joined.size(); ++v) {
    if (!joined[v]) out.names.push_back(fmt::format("{}", out.names.size()));
    out.of.push_back(static_cast<std::uint32_t>(out.names.size() - 1));
  }
  if (2 * out.names.size() > joined.size() + 1)
    return fail(ErrorCode::unsupported,
                "{}: of {} vertices, {} have no edge to the one before: expected odometry along increasing ids",
                source.path, joined.size(), out.names.size());
  return out;
}

Result<NamedGraph> from_g2o(const GraphSource& source) {
  std::vector<std::string> paths = {source.path};
  paths.insert(paths.end(), source.more.begin(), source.more.end());
  const auto file = formats::read_g2o(paths);
  if (!file) return tl::unexpected(file.error());
  std::vector<formats::VertexStamp> stamps;
  if (const std::string beside = formats::stamps_beside(source.path); is_a_file(beside)) {
    auto read = formats::read_graph_stamps(beside);
    if (!read) return tl::unexpected(read.error());
    stamps = std::move(*read);
  }
  return name_graph(source, *file, stamps);
}

std::string beside(const std::string& path, const char* ending) {
  std::filesystem::path out(path);
  out.replace_filename(out.stem().string() + ending + out.extension().string());
  return out.string();
}

enum class Wanted { poses, edges };
/// A file's vertices and edges alone; without poses where only edges are asked for.
struct Plain {
  std::vector<std::string> names;
  std::vector<std::optional<Pose3>> poses;
  std::vector<PoseGraphEdge> edges;
};

Result<Plain> read_plain(const std::string& path, Wanted wanted) {
  const auto pyfg = is_pyfg(path);
  if (!pyfg) return tl::unexpected(pyfg.error());
  Plain out;
  if (!*pyfg) {
    auto file = wanted == Wanted::poses ? formats::read_g2o(path) : formats::read_g2o_edges(path);
    if (!file) return tl::unexpected(file.error());
    for (const std::int64_t id : file->vertex_ids) out.names.push_back(formats::vertex_name(id));
    out.poses.assign(file->graph.poses.begin(), file->graph.poses.end());
    out.edges = std::move(file->graph.edges);
    return out;
  }
  const auto file = formats::read_fleet_graph(path);
  if (!file) return tl::unexpected(file.error());
  for (const auto& vertex : file->vertices) {
    out.names.push_back(to_string(vertex.name));
    out.poses.push_back(vertex.pose);
  }
  for (const auto& edge : file->edges) out.edges.push_back({edge.from, edge.to, edge.measurement.T_a_b});
  return out;
}

/// An edge by the names of its ends and where it has the second one, to the millimetre.
using EdgeKey = std::tuple<std::string, std::string, long, long, long>;
EdgeKey key_of(const std::vector<std::string>& names, const PoseGraphEdge& edge) {
  const Eigen::Vector3d mm = 1e3 * edge.T_from_to.translation;
  return {names[edge.from], names[edge.to], std::lround(mm.x()), std::lround(mm.y()), std::lround(mm.z())};
}

/// Every component where its first fixed vertex, or else its first one, is in the file.
Status put_in_place(const NamedGraph& graph, server::MapEstimate& map) {
  std::map<std::uint32_t, std::size_t> anchors;
  for (std::size_t v = 0; v < map.nodes.size(); ++v) {
    const auto [anchor, is_first] = anchors.try_emplace(map.nodes[v].component, v);
    if (is_first || !graph.fixed_poses[v]) continue;
    if (graph.fixed_poses[anchor->second] && !graph.is_pyfg)
      return fail(ErrorCode::unsupported,
                  "FIX names vertices {} and {} of one component: --robust holds one, leave the others out",
                  graph.names[anchor->second], graph.names[v]);
    if (!graph.fixed_poses[anchor->second]) anchor->second = v;
  }
  std::map<std::uint32_t, Pose3> moves;
  for (const auto& [component, v] : anchors)
    moves[component] = graph.fixed_poses[v].value_or(graph.robots.graph.poses[v]) * map.nodes[v].T_world_body.inverse();
  for (std::size_t v = 0; v < map.nodes.size(); ++v)
    map.graph.poses[v] = map.nodes[v].T_world_body = moves.at(map.nodes[v].component) * map.nodes[v].T_world_body;
  return {};
}

}  // namespace

Result<NamedGraph> name_graph(const GraphSource& source, const formats::G2oFile& file,
                              std::span<const formats::VertexStamp> stated) {
  NamedGraph out{.is_2d = file.is_2d,
                 .replaced = file.indefinite_edges,
                 .repeated = file.repeated_edges,
                 .left_out = file.left_out};
  std::map<std::int64_t, formats::VertexStamp> stamps;
  for (const auto& stamp : stated) stamps[stamp.vertex_id] = stamp;
  if (!stated.empty())
    if (const auto rows = formats::rows_of(file.vertex_ids, stated, formats::stamps_beside(source.path), source.path);
        !rows)
      return tl::unexpected(rows.error());
  const bool has_letters =
      std::ranges::all_of(file.vertex_ids, [](auto id) { return formats::letter_of(id).has_value(); });
  Robots robots;
  if (!source.robots.empty()) {
    auto found = robots_by_ranges(source, file);
    if (!found) return tl::unexpected(found.error());
    robots = std::move(*found);
    out.robots_from = "--robots";
  } else if (!stamps.empty()) {
    std::map<RobotId, std::uint32_t> number;
    for (const auto& [id, stamp] : stamps) number.try_emplace(stamp.keyframe.chain.robot, 0);
    for (auto& [robot, n] : number) {
      n = static_cast<std::uint32_t>(robots.names.size());
      robots.names.push_back(fmt::format("{}", robot.value));
    }
    for (const std::int64_t id : file.vertex_ids) robots.of.push_back(number.at(stamps.at(id).keyframe.chain.robot));
    out.robots_from = formats::stamps_beside(source.path);
  } else if (has_letters) {
    robots = robots_by_letters(file);
    out.robots_from = "symbol keys of the vertices";
  } else {
    auto found = robots_by_gaps(source, file);
    if (!found) return tl::unexpected(found.error());
    robots = std::move(*found);
    out.robots_from = "gaps in odometry";
  }
  out.robot_names = std::move(robots.names);
  std::vector<Loose> loose;
  for (std::size_t v = 0; v < file.vertex_ids.size(); ++v)
    loose.push_back({robots.of[v], stamps.empty() ? 0 : stamps.at(file.vertex_ids[v]).stamp.ns, v});
  std::vector<Loose> ordered = loose;
  std::ranges::sort(ordered, {}, [](const Loose& v) { return std::tuple(v.robot, v.order, v.position); });
  for (const Loose& v : ordered) {
    const std::int64_t id = file.vertex_ids[v.position];
    out.ids.push_back(id);
    out.names.push_back(formats::vertex_name(id));
    const bool is_fixed = std::ranges::binary_search(file.fixed, v.position);
    out.fixed_poses.push_back(is_fixed ? std::optional(file.graph.poses[v.position]) : std::nullopt);
    if (!stamps.empty()) out.robots.stamps.push_back(stamps.at(id).stamp);
  }
  place(file.graph, std::move(loose), out);
  out.stamps_from = formats::stamps_beside(source.path);
  if (stamps.empty() || !are_times(out)) count_seconds(out);
  return out;
}

Result<server::JudgedGraph> judge(const NamedGraph& graph, const std::string& path, const std::function<bool()>& stop) {
  const judge::Patience patience(stop);
  server::JudgedGraph judged = server::judge_graph(graph.robots, {});
  if (!judged.map.left_out.empty())
    return fail(ErrorCode::invalid, "{}: the edges of robot {} cannot be solved", path,
                graph.robot_names[judged.map.left_out.front().chain.robot.value]);
  if (!judged.map.converged) return fail(ErrorCode::invalid, "{}: cannot be solved", path);
  if (auto ok = put_in_place(graph, judged.map); !ok) return in_context(path, ok.error());
  return judged;
}

Result<NamedGraph> read_graph(const GraphSource& source) {
  const auto pyfg = is_pyfg(source.path);
  if (!pyfg) return tl::unexpected(pyfg.error());
  if (*pyfg && !source.more.empty())
    return fail(ErrorCode::configuration, "{}: is a graph of several robots already, expected one file", source.path);
  return *pyfg ? from_pyfg(source) : from_g2o(source);
}

Result<GraphTruth> read_truth(const GraphSource& source, const NamedGraph& graph) {
  GraphTruth out;
  if (source.truth.empty() && graph.is_pyfg && graph.has_poses) {
    out.poses.assign(graph.robots.graph.poses.begin(), graph.robots.graph.poses.end());
  } else if (!source.truth.empty() && source.truth != "none") {
    const auto truth = read_plain(source.truth, Wanted::poses);
    if (!truth) return tl::unexpected(truth.error());
    std::map<std::string, std::optional<Pose3>> poses;
    for (std::size_t v = 0; v < truth->names.size(); ++v) poses[truth->names[v]] = truth->poses[v];
    for (const std::string& name : graph.names) out.poses.push_back(poses[name]);
    if (std::ranges::none_of(out.poses, [](const auto& pose) { return pose.has_value(); }))
      return fail(ErrorCode::invalid, "{}: has none of the vertices of {}", source.truth, source.path);
  }
  const std::string clean = beside(source.path, "_no_outliers");
  const std::string path = !source.right.empty() ? source.right : is_a_file(clean) ? clean : std::string();
  if (path.empty()) return out;
  const auto right = read_plain(path, Wanted::edges);
  if (!right) return tl::unexpected(right.error());
  std::map<EdgeKey, int> left;
  for (const PoseGraphEdge& edge : right->edges) ++left[key_of(right->names, edge)];
  for (const PoseGraphEdge& edge : graph.robots.graph.edges) {
    const auto found = left.find(key_of(graph.names, edge));
    out.right.push_back(found != left.end() && found->second > 0);
    if (out.right.back()) --found->second;
  }
  return out;
}

}  // namespace tutti::app
