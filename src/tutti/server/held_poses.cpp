// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/held_poses.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "tutti/estimation/edge_roles.hpp"
#include "tutti/estimation/fixed_nodes.hpp"
#include "tutti/geometry/alignment.hpp"

namespace tutti::server {
namespace {

/// The nodes of one component, and those among them that are held.
struct HeldPart {
  std::vector<std::size_t> nodes, held;
};

/// T_held_world, by the positions of the held nodes; of one alone, by its pose.
Pose3 to_held(const MapEstimate& map, const HeldPart& part, const HeldPoses& held) {
  std::vector<Eigen::Vector3d> before, after;
  for (const std::size_t i : part.held) {
    before.push_back(map.nodes[i].T_world_body.translation);
    after.push_back(held.at(map.nodes[i].id).translation);
  }
  if (part.held.size() < 3) {
    const MapNode& node = map.nodes[part.held.front()];
    return held.at(node.id) * node.T_world_body.inverse();
  }
  return align_points(after, before);
}

}  // namespace

MapEstimate hold(MapEstimate map, const HeldPoses& held, const estimation::SolverConfig& config) {
  std::map<std::uint32_t, HeldPart> parts;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    HeldPart& part = parts[map.nodes[i].component];
    part.nodes.push_back(i);
    if (held.contains(map.nodes[i].id)) part.held.push_back(i);
  }
  std::vector<std::size_t> fixed;
  for (const auto& [component, part] : parts) {
    if (part.held.empty()) continue;
    const Pose3 T_held_world = to_held(map, part, held);
    for (const std::size_t i : part.nodes) map.graph.poses[i] = T_held_world * map.nodes[i].T_world_body;
    for (const std::size_t i : part.held) map.graph.poses[i] = held.at(map.nodes[i].id);
    fixed.insert(fixed.end(), part.held.begin(), part.held.end());
  }
  if (fixed.empty()) return map;
  std::ranges::sort(fixed);
  estimation::SolverConfig from_here = config;
  from_here.initialisation = "given";
  const auto solved =
      estimation::solve_pose_graph(map.graph, from_here, estimation::roles_of(map.graph, map.odometry_edges), fixed);
  if (estimation::is_usable(solved.summary.termination)) map.graph.poses = solved.poses;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  for (const std::size_t i : fixed) map.nodes[i].T_world_body = map.graph.poses[i] = held.at(map.nodes[i].id);
  return map;
}

}  // namespace tutti::server
