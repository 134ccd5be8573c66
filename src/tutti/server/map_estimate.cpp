// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_estimate.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace tutti::server {
namespace {

using NodeIndex = std::unordered_map<KeyframeId, std::size_t>;

/// Standard deviations below these (m, rad) are not believed: they make the normal equations needlessly stiff.
constexpr double kMinTranslationSigma = 1e-4;
constexpr double kMinRotationSigma = 1e-5;

Matrix6d information_of(const Matrix6d& covariance) {
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kMinTranslationSigma * kMinTranslationSigma;
  floored.diagonal().tail<3>().array() += kMinRotationSigma * kMinRotationSigma;
  const Matrix6d inverse = floored.llt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

/// Nodes and odometry edges of all submaps. Neighbouring submaps share a keyframe, so they attach by its id; a missing
/// submap leaves a gap, and what follows it hangs on by closures alone until the submap comes.
NodeIndex attach_submaps(const SubmapSet& submaps, MapEstimate& map) {
  for (const auto& [id, submap] : submaps)
    for (const Keyframe& k : submap->keyframes) {
      const KeyframeId node{id.robot, k.index};
      if (map.nodes.empty() || map.nodes.back().id < node)
        map.nodes.push_back({node, k.stamp, k.representative, k.T_odom_body, k.T_odom_body, 0});
    }
  NodeIndex index;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) index.emplace(map.nodes[i].id, i);
  for (const MapNode& node : map.nodes) map.graph.poses.push_back(node.T_odom_body);
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      map.graph.edges.push_back({.from = index.at({id.robot, submap->keyframes[k].index}),
                                 .to = index.at({id.robot, submap->keyframes[k + 1].index}),
                                 .T_from_to = submap->odometry[k].T_a_b,
                                 .information = information_of(submap->odometry[k].covariance)});
  map.odometry_edges = map.graph.edges.size();
  return index;
}

/// Each robot's odometry as the consistency check wants it. Chains with a gap are cut there: the longest piece counts.
std::vector<estimation::OdometryChain> odometry_chains(const SubmapSet& submaps, const MapEstimate& map) {
  std::map<KeyframeId, Matrix6d> step_covariance;  // of the step that starts at this keyframe
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      step_covariance[{id.robot, submap->keyframes[k].index}] = submap->odometry[k].covariance;

  std::map<RobotId, estimation::OdometryChain> longest;
  estimation::OdometryChain piece;
  const auto close_piece = [&] {
    auto& best = longest[piece.robot];
    if (piece.T_odom_body.size() > best.T_odom_body.size()) best = piece;
  };
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const MapNode& node = map.nodes[i];
    const KeyframeId before{node.id.robot, node.id.index - 1};
    const auto step = node.id.index == 0 ? step_covariance.end() : step_covariance.find(before);
    const bool continues = !piece.T_odom_body.empty() && piece.robot == node.id.robot && step != step_covariance.end();
    if (!continues) {
      if (!piece.T_odom_body.empty()) close_piece();
      piece = {.robot = node.id.robot, .first_index = node.id.index};
    } else {
      piece.step_covariance.push_back(step->second);
    }
    piece.T_odom_body.push_back(node.T_odom_body);
  }
  if (!piece.T_odom_body.empty()) close_piece();
  std::vector<estimation::OdometryChain> chains;
  for (auto& [robot, chain] : longest) chains.push_back(std::move(chain));
  return chains;
}

/// All closures of all verdicts whose keyframes are in the map, in a fixed order.
std::vector<LoopClosure> collect_closures(const VerdictSet& verdicts, const NodeIndex& index) {
  std::vector<LoopClosure> closures;
  for (const auto& [pair, verdict] : verdicts)
    for (const LoopClosure& closure : verdict.closures)
      if (index.contains(closure.from) && index.contains(closure.to)) closures.push_back(closure);
  std::stable_sort(closures.begin(), closures.end(), [](const LoopClosure& a, const LoopClosure& b) {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  });
  return closures;
}

/// Pairwise consistency per pair of robots; two robots are joined only by enough closures that agree.
std::vector<bool> consistent_closures(const std::vector<estimation::OdometryChain>& chains,
                                      const std::vector<LoopClosure>& closures, const MapConfig& config) {
  auto result = estimation::pairwise_consistency(chains, closures, config.consistency);
  for (const estimation::ConsistencyGroup& group : result.groups) {
    const bool joins = group.first != group.second;
    const auto least = static_cast<std::size_t>(joins ? config.min_inter_robot_closures : 1);
    if (group.accepted.size() < least)
      for (const std::size_t i : group.accepted) result.accepted[i] = false;
  }
  return result.accepted;
}

void label_components(MapEstimate& map) {
  std::vector<std::size_t> root(map.nodes.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const PoseGraphEdge& edge : map.graph.edges) {
    const auto [low, high] = std::minmax({find(edge.from), find(edge.to)});
    root[high] = low;
  }
  std::unordered_map<std::size_t, std::uint32_t> label;
  for (std::size_t i = 0; i < map.nodes.size(); ++i)
    map.nodes[i].component = label.try_emplace(find(i), static_cast<std::uint32_t>(label.size())).first->second;
  map.components = static_cast<std::uint32_t>(label.size());
}

}  // namespace

MapEstimate estimate_map(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config) {
  MapEstimate map;
  const NodeIndex index = attach_submaps(submaps, map);
  const std::vector<LoopClosure> closures = collect_closures(verdicts, index);
  const std::vector<bool> consistent = consistent_closures(odometry_chains(submaps, map), closures, config);

  PoseGraph graph = map.graph;
  std::vector<std::size_t> closure_of_edge;
  for (std::size_t i = 0; i < closures.size(); ++i) {
    map.closures.push_back({closures[i], false});
    if (!consistent[i]) continue;
    graph.edges.push_back({.from = index.at(closures[i].from),
                           .to = index.at(closures[i].to),
                           .T_from_to = closures[i].measurement.T_a_b,
                           .information = information_of(closures[i].measurement.covariance)});
    closure_of_edge.push_back(i);
  }
  std::vector<estimation::EdgeRole> roles(graph.edges.size(), estimation::EdgeRole::trusted);
  std::fill(roles.begin() + static_cast<std::ptrdiff_t>(map.odometry_edges), roles.end(), estimation::EdgeRole::robust);
  const estimation::GncResult robust = estimation::solve_pose_graph_gnc(graph, config.gnc, roles);

  for (std::size_t k = 0; k < closure_of_edge.size(); ++k) {
    const std::size_t edge = map.odometry_edges + k;
    if (robust.inlier_weight[edge] < 0.5) continue;
    map.graph.edges.push_back(graph.edges[edge]);
    map.closures[closure_of_edge[k]].accepted = true;
  }
  map.graph.poses = robust.solution.poses;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  map.converged = estimation::is_usable(robust.solution.summary.termination);
  label_components(map);
  return map;
}

}  // namespace tutti::server
