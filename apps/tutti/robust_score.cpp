// SPDX-License-Identifier: BSD-3-Clause
#include "robust_score.hpp"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::app {
namespace {

/// Poses in the order of the graph's vertices; those of one component share a frame.
struct Placed {
  std::vector<Pose3> poses;
  std::vector<int> components;
};

Placed placed(const server::MapEstimate& map) {
  Placed out;
  for (const MapNode& node : map.nodes) {
    out.poses.push_back(node.T_world_body);
    out.components.push_back(static_cast<int>(node.component));
  }
  return out;
}

/// Nothing when the edges do not determine every pose.
std::optional<Placed> solved(const PoseGraph& graph) {
  const auto solution = estimation::solve_pose_graph(graph, {});
  if (!estimation::is_usable(solution.summary.termination)) return std::nullopt;
  DisjointSets sets(graph.poses.size());
  for (const PoseGraphEdge& edge : graph.edges) sets.join(edge.from, edge.to);
  return Placed{solution.poses, sets.labels().first};
}

PoseGraph of_right_closures(const NamedGraph& graph, const server::JudgedGraph& judged, const GraphTruth& truth) {
  PoseGraph out{.poses = graph.robots.graph.poses, .edges = {}};
  for (std::size_t e = 0; e < judged.edges.size(); ++e)
    if (judged.edges[e].odometry || truth.right[e]) out.edges.push_back(graph.robots.graph.edges[e]);
  return out;
}

int largest_component(std::span<const int> components) {
  std::map<int, std::size_t> sizes;
  for (const int component : components) ++sizes[component];
  return std::ranges::max_element(sizes, {}, [](const auto& of) { return of.second; })->first;
}

MapErrors errors_of(const NamedGraph& graph, const Placed& map, const GraphTruth& truth) {
  MapErrors out;
  const int largest = largest_component(map.components);
  std::vector<evaluation::PosePair> joint;
  std::vector<std::vector<evaluation::PosePair>> robots(graph.robot_names.size());
  std::vector<bool> is_in_joint(graph.robot_names.size(), false);
  for (std::size_t v = 0; v < truth.poses.size(); ++v) {
    if (!truth.poses[v]) continue;
    const evaluation::PosePair pair{graph.robots.stamps[v], map.poses[v], *truth.poses[v]};
    const std::size_t robot = graph.robots.vertices[v].chain.robot.value;
    robots[robot].push_back(pair);
    if (map.components[v] != largest) continue;
    joint.push_back(pair);
    is_in_joint[robot] = true;
  }
  out.joint = evaluation::ate(joint);
  out.robots_in_joint = static_cast<std::size_t>(std::ranges::count(is_in_joint, true));
  for (const auto& pairs : robots) out.robots.push_back(evaluation::ate(pairs));
  return out;
}

}  // namespace

Score score(const NamedGraph& graph, const server::JudgedGraph& judged, const GraphTruth& truth) {
  Score out{.map = errors_of(graph, placed(judged.map), truth), .perfect = {}, .has_labels = !truth.right.empty()};
  for (std::size_t e = 0; e < truth.right.size(); ++e) {
    if (judged.edges[e].odometry) continue;
    out.right += truth.right[e] ? 1U : 0U;
    out.accepted += judged.edges[e].accepted ? 1U : 0U;
    out.right_accepted += truth.right[e] && judged.edges[e].accepted ? 1U : 0U;
  }
  if (!out.has_labels || !out.map.joint) return out;
  if (const auto perfect = solved(of_right_closures(graph, judged, truth)))
    out.perfect = errors_of(graph, *perfect, truth);
  return out;
}

}  // namespace tutti::app
