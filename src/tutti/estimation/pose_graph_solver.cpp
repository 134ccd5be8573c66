// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/pose_graph_solver.hpp"

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/fixed_nodes.hpp"
#include "tutti/estimation/internal/chordal.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"

namespace tutti::estimation {

std::vector<EdgeRole> roles_from_numbering(const PoseGraph& graph) {
  std::vector<EdgeRole> roles;
  roles.reserve(graph.edges.size());
  for (const auto& edge : graph.edges) {
    const bool consecutive = edge.to == edge.from + 1 || edge.from == edge.to + 1;
    roles.push_back(consecutive ? EdgeRole::trusted : EdgeRole::robust);
  }
  return roles;
}

bool is_cheaper(double cost, double other) {
  constexpr double kOne = 1e-6;
  return cost < other - kOne * (other + 1.0);
}

double chi2(const PoseGraph& graph) {
  double sum = 0.0;
  for (const auto& edge : graph.edges) {
    const Vector6d r = between_residual(graph.poses[edge.from], graph.poses[edge.to], edge.T_from_to);
    sum += r.dot(edge.information * r);
  }
  return sum;
}

PoseGraphSolution solve_pose_graph(const PoseGraph& graph, const SolverConfig& config,
                                   std::span<const EdgeRole> roles) {
  return solve_pose_graph(graph, config, roles, {});
}

PoseGraphSolution solve_pose_graph(const PoseGraph& graph, const SolverConfig& config, std::span<const EdgeRole> roles,
                                   std::span<const std::size_t> fixed, const std::function<bool()>& stop) {
  TUTTI_CHECK(roles.empty() || roles.size() == graph.edges.size(), "{} roles, {} edges", roles.size(),
              graph.edges.size());
  PoseGraphSolution solution{.poses = graph.poses, .weights = std::vector<double>(graph.edges.size(), 1.0)};
  if (!internal::is_finite(graph)) {
    solution.summary.termination = Termination::invalid_input;
    return solution;
  }
  const auto structure = internal::analyse_blocks(graph, {}, fixed);
  solution.summary.components = structure.components;
  if (config.initialisation == "chordal" && !internal::chordal(graph, structure, solution.poses)) {
    solution.summary.termination = Termination::singular;
    return solution;
  }
  const internal::EdgeCosts costs{.loss = config.loss, .roles = roles, .scale = {}};
  internal::GraphEquations equations(graph, structure);
  solution.summary = internal::minimise(equations, solution.poses, costs, config, {.stop = stop});
  if (costs.loss.kind != LossKind::none) {
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      const auto& edge = graph.edges[e];
      const Vector6d r = between_residual(solution.poses[edge.from], solution.poses[edge.to], edge.T_from_to);
      solution.weights[e] = costs.weight(e, r.dot(edge.information * r));
    }
  }
  return solution;
}

}  // namespace tutti::estimation
