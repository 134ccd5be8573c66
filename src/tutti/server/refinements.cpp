// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_refiner.hpp"

#include <algorithm>
#include <utility>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/estimation/termination.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/closure_judge.hpp"

namespace tutti::server {
namespace {

bool has_failed(const MapEstimate& map, const KeyframeId& from) {
  return std::ranges::any_of(map.failed_odometry, [&](const FailedOdometry& failed) {
    return failed.chain == from.chain && failed.from <= from.index && from.index < failed.to;
  });
}

}  // namespace

MapEstimate refined(const MapEstimate& map, const Refinement& refinement) {
  const auto& [steps, T_world_body] = refinement;
  if (steps.empty() || !map.converged) return map;
  MapEstimate out = map;
  for (std::size_t e = 0; e < out.odometry_edges; ++e) {
    PoseGraphEdge& edge = out.graph.edges[e];
    const KeyframeId from = map.nodes[edge.from].id, to = map.nodes[edge.to].id;
    const auto step = std::ranges::lower_bound(steps, from, {}, &RefinedStep::from);
    if (step == steps.end() || step->from != from || to.index != from.index + 1 || has_failed(map, from)) continue;
    const auto overstated = map.overstated.find(from.chain);
    out.odometry_of_steps[e] =
        edge.information.inverse() * (overstated == map.overstated.end() ? 1.0 : overstated->second);
    edge.T_from_to = step->measurement.T_a_b;
    edge.information = information_of(bounded_covariance(step->measurement.covariance));
  }
  for (std::size_t e = out.odometry_edges; e < out.graph.edges.size(); ++e) {
    PoseGraphEdge& edge = out.graph.edges[e];
    const auto from = T_world_body.find(map.nodes[edge.from].id), to = T_world_body.find(map.nodes[edge.to].id);
    if (from != T_world_body.end() && to != T_world_body.end()) edge.T_from_to = from->second.inverse() * to->second;
  }
  auto solution = estimation::solve_pose_graph(out.graph, {.initialisation = "given"});
  if (!estimation::is_usable(solution.summary.termination)) return map;
  out.graph.poses = std::move(solution.poses);
  for (std::size_t i = 0; i < out.nodes.size(); ++i) out.nodes[i].T_world_body = out.graph.poses[i];
  return out;
}

}  // namespace tutti::server
