// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/change_support.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "tutti/consistency/change_of_mind.hpp"
#include "tutti/consistency/signal.hpp"
#include "tutti/estimation/edge_roles.hpp"
#include "tutti/estimation/influence.hpp"
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

/// A group carries a change only if without it the chain lies farther from the newer map than half of the change, to
/// first order and but for the alignment. Groups that move it less than this share are not looked at any closer.
constexpr double kShare = 0.25;
/// Where that is looked at: a chain bends little between so many of its nodes.
constexpr std::size_t kMostLookedAt = 32;

/// So many groups are tried at most.
constexpr std::size_t kMostTried = 16;

/// The groups, in their order, that move the chain at least so far; where these are many, those that move it most.
std::vector<std::size_t> which_to_try(std::span<const double> moves_m, double least_m) {
  std::vector<std::size_t> out;
  for (std::size_t g = 0; g < moves_m.size(); ++g)
    if (moves_m[g] >= least_m) out.push_back(g);
  if (out.size() <= kMostTried) return out;
  std::ranges::stable_sort(out, std::greater(), [&](std::size_t g) { return moves_m[g]; });
  out.resize(kMostTried);
  std::ranges::sort(out);
  return out;
}

/// The chain's proxy nodes and which of the map's nodes they are.
struct OwnNodes {
  std::vector<std::size_t> proxies;
  std::vector<std::size_t> nodes;
};

OwnNodes own_nodes(const ProxyGraph& own, const ChainId& chain, const MapEstimate& map) {
  OwnNodes out;
  auto node = map.nodes.begin();
  for (std::size_t k = 0; k < own.nodes.size(); ++k) {
    if (own.nodes[k].chain != chain) continue;
    node = std::find_if(node, map.nodes.end(),
                        [&](const MapNode& n) { return n.id.chain == chain && n.stamp == own.nodes[k].stamp; });
    if (node == map.nodes.end()) break;
    out.proxies.push_back(k);
    out.nodes.push_back(static_cast<std::size_t>(node - map.nodes.begin()));
  }
  return out;
}

/// By how much each group's loss moves the chain, to first order, metres; infinite where that says little.
std::vector<double> first_order_moves(const MapEstimate& map, std::span<const estimation::EdgeRole> roles,
                                      const Groups& groups, const OwnNodes& part) {
  std::vector<std::size_t> nodes;
  const std::size_t count = std::min(kMostLookedAt, part.nodes.size());
  for (std::size_t k = 0; k < count; ++k)
    nodes.push_back(part.nodes[count == 1 ? 0 : k * (part.nodes.size() - 1) / (count - 1)]);
  std::vector<double> out(groups.size(), std::numeric_limits<double>::infinity());
  if (nodes.size() < 2) return out;
  std::vector<Pose3> with, without(nodes.size());
  for (const std::size_t node : nodes) with.push_back(map.graph.poses[node]);
  const Eigen::MatrixXd moves = estimation::group_removals(map.graph, map.graph.poses, roles, groups, nodes);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto move = moves.col(static_cast<Eigen::Index>(g));
    if (!move.allFinite()) continue;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      without[k] = retract(with[k], move.segment<6>(static_cast<Eigen::Index>(6 * k)));
    out[g] = consistency::pose_difference(with, without).leftCols<3>().rowwise().norm().maxCoeff();
  }
  return out;
}

}  // namespace

ChangeSupport change_support(const MapEstimate& map, const Beliefs& followed_beliefs, const ProxyGraph& followed,
                             const ProxyGraph& own, const ChainId& chain, const estimation::SolverConfig& solver) {
  ChangeSupport out;
  const Groups groups = groups_to_try(map, followed_beliefs);
  if (groups.empty()) return out;
  const std::vector<estimation::EdgeRole> roles = estimation::roles_of(map.graph, map.odometry_edges);
  const OwnNodes part = own_nodes(own, chain, map);
  const std::vector<double> first_order = first_order_moves(map, roles, groups, part);
  ++out.factorisations;
  const double least_m = kShare * consistency::map_change(followed, own, chain).translation_m;
  estimation::SolverConfig from_there = solver;
  from_there.initialisation = "given";
  std::optional<estimation::SwitchedGraph> graph;  // made when the first group is looked at closely
  for (const std::size_t g : which_to_try(first_order, least_m)) {
    if (!graph) graph.emplace(map.graph, roles, from_there);
    std::vector<char> in(map.graph.edges.size(), 1);
    for (const std::size_t e : groups[g]) in[e] = 0;
    ++out.tried;
    if (!estimation::is_usable(graph->solve(in))) continue;
    const std::vector<Pose3> poses = graph->poses();
    ProxyGraph without = own;
    for (std::size_t k = 0; k < part.nodes.size(); ++k)
      without.nodes[part.proxies[k]].T_world_body = poses[part.nodes[k]];
    if (consistency::map_change(followed, without, chain).translation_m <
        consistency::map_change(own, without, chain).translation_m) {
      out.lone_closures = groups[g].size();
      break;
    }
  }
  if (graph) out.factorisations += graph->factorisations();
  return out;
}

}  // namespace tutti::server
