// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/graph_recording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/formats/fleet_graph.hpp"

namespace tutti::mission {
namespace {

using formats::PyfgFile;

/// The letters of the robots in a graph, as names.
std::vector<std::string> robots_of(const PyfgFile& file) {
  std::set<char> letters;
  for (const auto& vertex : file.vertices) letters.insert(vertex.name.robot);
  std::vector<std::string> out;
  for (const char letter : letters) out.emplace_back(1, letter);
  return out;
}

/// The first edge between each vertex and the one before it, turned to lead to the later one; nothing where there is
/// none.
std::vector<const formats::PyfgEdge*> odometry_of(const PyfgFile& file) {
  std::vector<const formats::PyfgEdge*> out(file.vertices.size(), nullptr);
  for (const auto& edge : file.edges) {
    const std::size_t later = std::max(edge.from, edge.to);
    if (formats::is_odometry(file.vertices[edge.from].name, file.vertices[edge.to].name) && out[later] == nullptr)
      out[later] = &edge;
  }
  return out;
}

RelativePose towards(const formats::PyfgEdge& edge, std::size_t vertex) {
  return edge.to == vertex ? edge.measurement : inverse(edge.measurement);
}

/// Fails at the first vertex from `first` to `last` that no odometry joins to the one before it of its robot.
Status check_chains(const PyfgFile& file, const std::vector<const formats::PyfgEdge*>& odometry, std::size_t first,
                    std::size_t last) {
  for (std::size_t v = first + 1; v < last; ++v) {
    const auto &before = file.vertices[v - 1].name, &name = file.vertices[v].name;
    if (before.robot == name.robot && odometry[v] == nullptr)
      return fail(ErrorCode::invalid, "no odometry from {} to {}: expected a chain without gaps", to_string(before),
                  to_string(name));
  }
  return {};
}

/// The vertices from `first` to `last`, a chain, as odometry from the origin, and as reference.
void follow_chain(const PyfgFile& file, const std::vector<const formats::PyfgEdge*>& odometry,
                  const std::vector<Timestamp>& stamps, std::size_t first, std::size_t last, GraphRecording& out) {
  Pose3 T_odom_body;
  for (std::size_t v = first; v < last; ++v) {
    if (v > first) {
      const RelativePose step = towards(*odometry[v], v);
      T_odom_body = T_odom_body * step.T_a_b;
      out.increment_covariance.push_back(step.covariance);
    }
    out.odometry.push_back({stamps[v], T_odom_body});
    if (const auto& pose = file.vertices[v].pose) out.reference.push_back({stamps[v], *pose});
  }
}

/// Why a graph has no times, at its first vertex that shows it.
Error no_times(const PyfgFile& file) {
  for (std::size_t v = 1; v < file.vertices.size(); ++v) {
    const auto &before = file.vertices[v - 1], &vertex = file.vertices[v];
    if (vertex.name.robot == before.name.robot && vertex.stamp <= before.stamp)
      return {
          ErrorCode::invalid,
          fmt::format("stamp {} ns of {} does not follow {} ns of {}, nor do those of its odometry: a mission needs "
                      "times",
                      vertex.stamp.ns, to_string(vertex.name), before.stamp.ns, to_string(before.name))};
  }
  return {ErrorCode::invalid, "stamps are less than 1 ms apart: a mission needs times"};
}

}  // namespace

Result<GraphRecording> read_graph_recording(const std::string& path, const std::string& robot) {
  const auto file = formats::read_fleet_graph(path);
  if (!file) return tl::unexpected(file.error());
  const auto& vertices = file->vertices;
  const auto is_ours = [&](const formats::PyfgVertex& vertex) { return robot == std::string(1, vertex.name.robot); };
  const auto begin = std::ranges::find_if(vertices, is_ours);
  if (begin == vertices.end())
    return fail(ErrorCode::configuration, "{}: has no robot '{}', expected one of {} (robots[].graph.robot)", path,
                robot, fmt::join(robots_of(*file), ", "));
  const auto first = static_cast<std::size_t>(begin - vertices.begin());
  const auto last = static_cast<std::size_t>(std::find_if_not(begin, vertices.end(), is_ours) - vertices.begin());
  const auto odometry = odometry_of(*file);
  if (auto ok = check_chains(*file, odometry, first, last); !ok) return in_context(path, ok.error());
  const auto times = formats::times_of(*file);
  if (!times) {  // perhaps for want of odometry of another robot
    const Status whole = check_chains(*file, odometry, 0, vertices.size());
    return in_context(path, whole ? no_times(*file) : whole.error());
  }
  GraphRecording out;
  follow_chain(*file, odometry, times->stamps, first, last, out);
  for (const auto& edge : file->edges) {
    const std::size_t later = std::max(edge.from, edge.to), earlier = std::min(edge.from, edge.to);
    if (later < first || later >= last || odometry[later] == &edge) continue;
    out.closures.push_back({.from = std::string(1, vertices[earlier].name.robot),
                            .from_stamp = times->stamps[earlier],
                            .to_stamp = times->stamps[later],
                            .measurement = towards(edge, later),
                            .arrived = edge.stamp});
  }
  out.notes.push_back(fmt::format("{} poses and {} closures of {}; stamps {}", last - first, out.closures.size(),
                                  std::filesystem::path(path).filename().string(), times->from));
  return out;
}

Result<std::string> graph_mission(const std::string& file, const std::filesystem::path& data) {
  const auto graph = formats::read_fleet_graph((data / file).string());
  if (!graph) return tl::unexpected(graph.error());
  const auto scalar = [](std::string text) {
    return ConfigNode{.kind = ConfigNode::Kind::scalar, .scalar = std::move(text)};
  };
  const auto map = [](std::vector<ConfigNode::Entry> entries) {
    return ConfigNode{.kind = ConfigNode::Kind::map, .map = std::move(entries)};
  };
  ConfigNode robots{.kind = ConfigNode::Kind::list};
  for (const std::string& robot : robots_of(*graph))
    robots.list.push_back(map({{"name", scalar(robot)}, {"graph", map({{"file", scalar(file)}})}}));
  return to_yaml(map({{"mission", scalar(std::filesystem::path(file).stem().string())},
                      {"input", scalar("a pose graph: its odometry, and its closures at their time of arrival")},
                      {"robots", robots},
                      {"closures", map({{"verifier", scalar("recorded")}})}}));
}

}  // namespace tutti::mission
