// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/doubt.hpp"

#include <algorithm>

#include "tutti/estimation/between_factor.hpp"

namespace tutti::estimation::internal {
namespace {

/// An edge that weighs less is let go.
constexpr double kLetGo = 0.5;

struct Candidate {
  std::vector<Pose3> poses;
  SolveSummary solve;
};

bool lets_go(const PoseGraph& graph, const std::vector<Pose3>& poses, const EdgeCosts& costs) {
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (!costs.is_robust(e)) continue;
    const PoseGraphEdge& edge = graph.edges[e];
    const Vector6d r = between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
    if (costs.weight(e, r.dot(edge.information * r)) < kLetGo) return true;
  }
  return false;
}

}  // namespace

DoubtingSummary minimise_doubting(NormalEquations& equations, std::span<const EdgeRole> roles, const RobustLoss& loss,
                                  const SolverConfig& config, const Continuation& how, std::vector<Pose3>& poses) {
  int iterations = 0;
  const auto minimise = [&](std::vector<Pose3> start, const EdgeCosts& costs) {
    Candidate out{.poses = std::move(start), .solve = {}};
    out.solve = internal::minimise(equations, out.poses, costs, config, how);
    iterations += out.solve.iterations;
    return out;
  };
  const bool doubt = std::find(roles.begin(), roles.end(), EdgeRole::robust) != roles.end();
  std::vector<double> without(doubt ? roles.size() : 0, 1.0);
  for (std::size_t e = 0; e < without.size(); ++e)
    if (roles[e] == EdgeRole::robust) without[e] = 0.0;
  Candidate best = minimise(poses, {.loss = {}, .roles = {}, .scale = without});
  const double initial_cost = best.solve.initial_cost;
  if (doubt && is_usable(best.solve.termination)) {
    const EdgeCosts robust{.loss = loss, .roles = roles, .scale = {}};
    std::vector<Pose3> trusted = best.poses;
    best = minimise(std::move(best.poses), robust);
    if (lets_go(equations.graph(), best.poses, robust)) {
      Candidate all = minimise(std::move(trusted), {});
      all = minimise(std::move(all.poses), robust);
      if (all.solve.final_cost < best.solve.final_cost) best = std::move(all);
    }
  }
  poses = std::move(best.poses);
  best.solve.initial_cost = initial_cost;
  best.solve.iterations = iterations;
  return {.solve = best.solve, .loss_applied = doubt};
}

}  // namespace tutti::estimation::internal
