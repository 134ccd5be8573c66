// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"

/// The other school, on our solver: graduated non-convexity with the Geman-McClure loss, from given poses.
namespace tutti::bench {

struct GemanMcClure {
  std::vector<Pose3> poses;
  std::vector<bool> accepted;  ///< Per edge: its squared error is below the chi-square quantile in the end.
};

/// Weights and schedule of Yang, Antonante, Tzoumas, Carlone (RA-L 2020), section IV.B and remark 5:
///   w = (mu c^2 / (r^2 + mu c^2))^2, mu from 2 max r^2 / c^2 down by 1.4 to 1.
/// Gauss-Newton inside, as many steps as our own GNC takes; at mu = 1 until the weights stand.
inline void graduate(const PoseGraph& graph, std::span<const estimation::EdgeRole> roles, double c2,
                     const estimation::SolverConfig& config, bool from_far, std::vector<Pose3>& poses) {
  using namespace estimation;
  const auto structure = internal::analyse_blocks(graph);
  internal::GraphEquations equations(graph, structure);
  const auto squared = [&](std::size_t e) {
    const PoseGraphEdge& edge = graph.edges[e];
    const Vector6d r = between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
    return r.dot(edge.information * r);
  };
  double worst = 0.0;
  for (std::size_t e = 0; e < graph.edges.size(); ++e)
    if (roles[e] == EdgeRole::robust) worst = std::max(worst, squared(e));
  std::vector<double> scale(graph.edges.size(), 1.0);
  SolverConfig inner = config;
  inner.relative_cost_tolerance = 1e-3;
  inner.max_iterations = 4;
  int rounds_at_the_end = 0;
  for (double mu = from_far ? std::max(1.0, 2.0 * worst / c2) : 1.0; rounds_at_the_end < 50;
       mu = std::max(1.0, mu / 1.4)) {
    double moved = 0.0;
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      if (roles[e] != EdgeRole::robust) continue;
      const double root = mu * c2 / (squared(e) + mu * c2);
      moved = std::max(moved, std::abs(root * root - scale[e]));
      scale[e] = root * root;
    }
    if (mu == 1.0 && ++rounds_at_the_end > 1 && moved < 1e-3) break;
    const auto summary = internal::minimise(equations, poses, {.loss = {}, .roles = roles, .scale = scale}, inner);
    if (!is_usable(summary.termination)) return;
  }
}

/// Chains of odometry are reduced to runs between closures as in our own GNC, then the whole graph is finished.
inline GemanMcClure solve_geman_mcclure(const PoseGraph& graph, std::span<const estimation::EdgeRole> roles,
                                        const estimation::GncConfig& config) {
  using namespace estimation;
  const double c2 = chi_square_quantile(config.confidence, 6.0);
  const ReducedGraph reduced = reduce_chains(graph, roles);
  std::vector<Pose3> poses;
  for (const std::size_t node : reduced.nodes) poses.push_back(graph.poses[node]);
  graduate(reduced.graph, reduced.roles, c2, config.solver, true, poses);
  GemanMcClure out{.poses = graph.poses, .accepted = {}};
  expand_chains(graph, reduced, poses, out.poses);
  graduate(graph, roles, c2, config.solver, false, out.poses);
  for (const PoseGraphEdge& edge : graph.edges) {
    const Vector6d r = between_residual(out.poses[edge.from], out.poses[edge.to], edge.T_from_to);
    out.accepted.push_back(r.dot(edge.information * r) <= c2);
  }
  return out;
}

}  // namespace tutti::bench
