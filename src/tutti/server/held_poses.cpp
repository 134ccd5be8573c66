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
struct HeldNodes {
  std::vector<std::size_t> all, held;
};

/// T_held_world, by the positions of the held nodes; of one alone, by its pose.
Pose3 to_held(const MapEstimate& map, const HeldNodes& nodes, const HeldPoses& held) {
  std::vector<Eigen::Vector3d> before, after;
  for (const std::size_t i : nodes.held) {
    before.push_back(map.nodes[i].T_world_body.translation);
    after.push_back(held.at(map.nodes[i].id).T_world_body.translation);
  }
  if (nodes.held.size() < 3) {
    const MapNode& node = map.nodes[nodes.held.front()];
    return held.at(node.id).T_world_body * node.T_world_body.inverse();
  }
  return align_points(after, before);
}

}  // namespace

std::optional<std::uint32_t> main_floor(const HeldPoses& held, const std::vector<KeyframeId>& nodes) {
  std::map<std::uint32_t, std::size_t> count;
  for (const KeyframeId& id : nodes)
    if (const auto pose = held.find(id); pose != held.end()) ++count[pose->second.floor];
  if (count.empty()) return std::nullopt;
  return std::ranges::max_element(count, {}, [](const auto& floor) { return floor.second; })->first;
}

MapEstimate hold(MapEstimate map, const HeldPoses& held, const estimation::SolverConfig& config) {
  if (held.empty()) return map;
  std::map<std::uint32_t, HeldNodes> components;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    HeldNodes& of = components[map.nodes[i].component];
    of.all.push_back(i);
    if (held.contains(map.nodes[i].id)) of.held.push_back(i);
  }
  std::vector<std::size_t> fixed;
  for (auto& [component, nodes] : components) {
    std::vector<KeyframeId> ids;
    for (const std::size_t i : nodes.held) ids.push_back(map.nodes[i].id);
    if (const auto floor = main_floor(held, ids))
      std::erase_if(nodes.held, [&](std::size_t i) { return held.at(map.nodes[i].id).floor != *floor; });
    const bool is_free = !nodes.held.empty();
    const Pose3 T_held_world = is_free ? to_held(map, nodes, held) : Pose3{};
    for (const std::size_t i : nodes.all)
      map.graph.poses[i] = is_free ? T_held_world * map.nodes[i].T_world_body : map.nodes[i].T_world_body;
    for (const std::size_t i : nodes.held) map.graph.poses[i] = held.at(map.nodes[i].id).T_world_body;
    const std::vector<std::size_t>& stay = is_free ? nodes.held : nodes.all;
    fixed.insert(fixed.end(), stay.begin(), stay.end());
  }
  std::ranges::sort(fixed);
  estimation::SolverConfig from_here = config;
  from_here.initialisation = "given";
  const auto solved =
      estimation::solve_pose_graph(map.graph, from_here, estimation::roles_of(map.graph, map.odometry_edges), fixed);
  if (estimation::is_usable(solved.summary.termination)) map.graph.poses = solved.poses;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  return map;
}

}  // namespace tutti::server
