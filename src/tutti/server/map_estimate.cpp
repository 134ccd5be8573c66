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

/// The robots' odometry as the trial wants it: one chain per piece without a gap.
std::vector<estimation::OdometryChain> odometry_chains(const SubmapSet& submaps, const MapEstimate& map) {
  std::unordered_map<KeyframeId, const Matrix6d*> step_covariance;  // of the step that ends at this keyframe
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      step_covariance[{id.robot, submap->keyframes[k + 1].index}] = &submap->odometry[k].covariance;

  std::vector<estimation::OdometryChain> chains;
  for (const MapNode& node : map.nodes) {
    const auto step = step_covariance.find(node.id);
    if (step == step_covariance.end())
      chains.push_back({.robot = node.id.robot, .first_index = node.id.index});
    else
      chains.back().step_covariance.push_back(*step->second);
    chains.back().T_odom_body.push_back(node.T_odom_body);
  }
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

/// What failed odometry is let go by over its whole stretch: enough for any jump, and the map stays in one piece.
constexpr double kFreeTranslation = 100.0;
constexpr double kFreeRotation = 3.0;

/// Chi-square (6 dof, 0.999) below which the odometry of a stretch agrees with the map after all.
constexpr double kRightAfterAll = 22.46;

/// Adds a variance (m, rad) to failed odometry, in equal shares to the steps of the stretch.
void weaken(PoseGraph& graph, const MapEstimate& map, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad) {
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = graph.edges[e];
    if (edge.from < from || edge.to > to) continue;
    Matrix6d covariance = edge.information.inverse();
    const double steps = static_cast<double>(to - from);
    covariance.diagonal().head<3>().array() += sigma_m * sigma_m / steps;
    covariance.diagonal().tail<3>().array() += sigma_rad * sigma_rad / steps;
    edge.information = information_of(covariance);
  }
}

/// Says by how much failed odometry missed, and leaves the graph as sure of it as it then deserves. A stretch that
/// turns out to have been right, nearly or within its own doubt, is no failure.
void record_failure(RobotId robot, std::size_t a, std::size_t b, double min_jump_m, MapEstimate& map) {
  const auto raw = [&](std::size_t i, std::size_t j) {
    return map.nodes[i].T_odom_body.inverse() * map.nodes[j].T_odom_body;
  };
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (edge.from < a || edge.to > b) continue;
    const Matrix6d to_end = adjoint(raw(b, edge.to));
    covariance += to_end * edge.information.inverse() * to_end.transpose();
  }
  const Vector6d jump = local(raw(a, b), map.nodes[a].T_world_body.inverse() * map.nodes[b].T_world_body);
  const double jump_m = jump.head<3>().norm();
  const double jump_rad = jump.tail<3>().norm();
  if (estimation::failure_size(jump_m, jump_rad) < 0.5 * min_jump_m) return;
  if (jump.dot(covariance.llt().solve(jump)) < kRightAfterAll) return;
  map.failed_odometry.push_back({robot, map.nodes[a].id.index, map.nodes[b].id.index, jump_m, jump_rad});
  weaken(map.graph, map, a, b, jump_m, jump_rad);
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
  const estimation::OdometryVerdict verdict =
      estimation::try_odometry(odometry_chains(submaps, map), closures, config.trial);

  PoseGraph graph = map.graph;
  for (const estimation::OdometryStretch& failed : verdict.failed)
    weaken(graph, map, index.at({failed.robot, failed.from}), index.at({failed.robot, failed.to}), kFreeTranslation,
           kFreeRotation);
  std::vector<std::size_t> closure_of_edge;
  for (std::size_t i = 0; i < closures.size(); ++i) {
    map.closures.push_back({closures[i], false});
    if (!verdict.accepted[i]) continue;
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
  for (const auto& [robot, from, to] : verdict.failed)
    record_failure(robot, index.at({robot, from}), index.at({robot, to}), config.trial.min_jump_m, map);
  label_components(map);
  return map;
}

}  // namespace tutti::server
