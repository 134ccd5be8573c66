// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/change_support.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <vector>

#include "tutti/consistency/change_of_mind.hpp"
#include "tutti/estimation/switched_graph.hpp"
#include "tutti/judge/closure_groups.hpp"

namespace tutti::server {
namespace {

/// Look-alikes of neighbouring submaps are one witness, however many they are; what agrees for longer is no look-alike.
constexpr judge::GroupLimits kWitness{15.0, 30.0, std::numeric_limits<std::size_t>::max()};

using Groups = std::vector<std::vector<std::size_t>>;  // edges of the map's graph

/// The groups that may carry the change, the largest first.
Groups groups_to_try(const MapEstimate& map, const Beliefs& followed) {
  std::vector<std::size_t> closures(map.graph.edges.size() - map.odometry_edges);
  std::iota(closures.begin(), closures.end(), map.odometry_edges);
  Groups groups = judge::closure_groups(map.nodes, map.graph.edges, closures, kWitness);
  const auto is_known = [&](std::size_t e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    return followed.accepted.contains({map.nodes[edge.from].id, map.nodes[edge.to].id});
  };
  const auto is_old = [&](const auto& group) { return std::ranges::all_of(group, is_known); };
  if (!std::ranges::all_of(groups, is_old)) std::erase_if(groups, is_old);
  std::ranges::stable_sort(groups, std::greater(), [](const auto& group) { return group.size(); });
  return groups;
}

/// The chain's proxy nodes at these poses of the map's nodes.
ProxyGraph moved(const ProxyGraph& own, const ChainId& chain, const MapEstimate& map, const std::vector<Pose3>& poses) {
  ProxyGraph out = own;
  auto node = map.nodes.begin();
  for (ProxyNode& proxy : out.nodes) {
    if (proxy.chain != chain) continue;
    node = std::find_if(node, map.nodes.end(),
                        [&](const MapNode& n) { return n.id.chain == chain && n.stamp == proxy.stamp; });
    if (node == map.nodes.end()) break;
    proxy.T_world_body = poses[static_cast<std::size_t>(node - map.nodes.begin())];
  }
  return out;
}

}  // namespace

ChangeSupport change_support(const MapEstimate& map, const Beliefs& followed_beliefs, const ProxyGraph& followed,
                             const ProxyGraph& own, const ChainId& chain, const estimation::SolverConfig& solver) {
  ChangeSupport out;
  const Groups groups = groups_to_try(map, followed_beliefs);
  if (groups.empty()) return out;
  std::vector<estimation::EdgeRole> roles(map.graph.edges.size(), estimation::EdgeRole::robust);
  std::fill_n(roles.begin(), map.odometry_edges, estimation::EdgeRole::trusted);
  estimation::SolverConfig from_there = solver;
  from_there.initialisation = "given";
  estimation::SwitchedGraph graph(map.graph, roles, from_there);
  for (const auto& group : groups) {
    std::vector<char> in(map.graph.edges.size(), 1);
    for (const std::size_t e : group) in[e] = 0;
    if (!estimation::is_usable(graph.solve(in))) continue;
    const ProxyGraph without = moved(own, chain, map, graph.poses());
    if (consistency::map_change(followed, without, chain).translation_m >=
        consistency::map_change(own, without, chain).translation_m)
      continue;
    out.lone_closures = group.size();
    break;
  }
  out.factorisations = graph.factorisations();
  return out;
}

}  // namespace tutti::server
