// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/gnc.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/fixed_nodes.hpp"
#include "tutti/estimation/internal/chordal.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/truncated_least_squares.hpp"

namespace tutti::estimation {
namespace {

constexpr double kControlStep = 2.0;  // factor of mu between outer iterations
constexpr int kMaxOuterIterations = 100;
/// A rejected edge keeps this weight inside the solver, so that what it alone connected stays determined.
constexpr double kWeightFloor = 1e-8;
/// Inner solves only follow the changing weights; the last one uses the caller's tolerance.
constexpr double kInnerTolerance = 1e-3;
constexpr int kInnerIterations = 4;
/// When the weights of fewer than one in so many edges change, the factor before is tried first. With many wrong
/// closures it would lead to other optima than Newton's steps do.
constexpr std::size_t kFewChange = 8;

/// Yang et al. eq. (14): weight for whitened squared error s, truncation c2 and control parameter mu.
double tls_weight(double s, double c2, double mu) {
  if (s >= (mu + 1.0) / mu * c2) return 0.0;
  if (s <= mu / (mu + 1.0) * c2) return 1.0;
  return std::sqrt(c2 * mu * (mu + 1.0) / s) - mu;
}

/// Remark 5: the largest mu with which errors up to `worst` truncations cost as a convex function of them.
double convex_until(double worst) { return 1.0 / (2.0 * worst - 1.0); }

double squared_error(const PoseGraphEdge& edge, const std::vector<Pose3>& poses) {
  const Vector6d r = between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
  return r.dot(edge.information * r);
}

bool is_binary(double weight) { return weight == 0.0 || weight == 1.0; }

}  // namespace

PoseGraphSolution least_squares(const PoseGraph& graph, const GncConfig& config, std::span<const std::size_t> fixed,
                                const std::function<bool()>& stop) {
  SolverConfig plain = config.solver;
  plain.loss = {};
  return solve_pose_graph(graph, plain, {}, fixed, stop);
}

GncResult truncated_least_squares(const PoseGraph& graph, const GncConfig& config, std::span<const double> truncation,
                                  const PoseGraphSolution& start, std::span<const std::size_t> fixed,
                                  const std::function<bool()>& stop) {
  const std::size_t edges = graph.edges.size();
  GncResult out{.solution = start, .inlier_weight = std::vector<double>(edges, 1.0)};
  if (!is_usable(out.solution.summary.termination)) return out;

  // In units of the truncation, so that one mu serves edges with different ones.
  std::vector<double> excess(edges, 0.0);
  const auto measure = [&] {  // returns the worst of what is not refused
    double worst = 0.0;
    for (std::size_t e = 0; e < edges; ++e) {
      if (!std::isfinite(truncation[e])) continue;
      excess[e] = squared_error(graph.edges[e], out.solution.poses) / truncation[e];
      if (out.inlier_weight[e] > 0.0) worst = std::max(worst, excess[e]);
    }
    return worst;
  };
  const double worst = measure();
  if (worst <= 1.0) return out;  // nothing to reject

  const auto structure = internal::analyse_blocks(graph, {}, fixed);
  internal::GraphEquations equations(graph, structure);
  std::vector<double> scale(edges, 1.0);
  const internal::EdgeCosts costs{.loss = {}, .roles = {}, .scale = scale};
  SolverConfig inner = config.solver;
  inner.relative_cost_tolerance = std::max(kInnerTolerance, config.solver.relative_cost_tolerance);
  inner.max_iterations = kInnerIterations;
  double mu = convex_until(worst);
  for (bool binary = false; !binary && out.outer_iterations < kMaxOuterIterations && !(stop && stop());
       ++out.outer_iterations) {
    binary = true;
    std::size_t changed = 0;
    for (std::size_t e = 0; e < edges; ++e) {
      if (!std::isfinite(truncation[e])) continue;
      const double before = std::exchange(out.inlier_weight[e], tls_weight(excess[e], 1.0, mu));
      changed += out.inlier_weight[e] != before ? 1 : 0;
      binary = binary && is_binary(out.inlier_weight[e]);
      scale[e] = std::max(out.inlier_weight[e], kWeightFloor);
    }
    if (binary) inner = config.solver;
    const int before = out.solution.summary.factorisations;
    out.solution.summary =
        internal::minimise(equations, out.solution.poses, costs, inner,
                           {.is_factorised = out.outer_iterations > 0 && kFewChange * changed < edges, .stop = stop});
    out.solution.summary.factorisations += before;
    if (!is_usable(out.solution.summary.termination)) return out;
    // Edges that are far off may be long gone, and all others fit.
    mu = std::max(kControlStep * mu, convex_until(std::max(1.0, measure())));
  }
  out.solution.weights = out.inlier_weight;
  return out;
}

namespace {

GncResult reweight(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles,
                   std::span<const std::size_t> fixed, const std::function<bool()>& stop) {
  std::vector<double> truncation(graph.edges.size(), chi_square_quantile(config.confidence, 6.0));
  for (std::size_t e = 0; e < roles.size(); ++e)
    if (roles[e] == EdgeRole::trusted) truncation[e] = std::numeric_limits<double>::infinity();
  return truncated_least_squares(graph, config, truncation, least_squares(graph, config, fixed, stop), fixed, stop);
}

}  // namespace

GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles) {
  return solve_pose_graph_gnc(graph, config, roles, {});
}

GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles,
                               std::span<const std::size_t> fixed, const std::function<bool()>& stop) {
  TUTTI_CHECK(roles.empty() || roles.size() == graph.edges.size(), "{} roles, {} edges", roles.size(),
              graph.edges.size());
  if (!internal::is_finite(graph)) return reweight(graph, config, roles, fixed, stop);  // reports it
  const ReducedGraph reduced = reduce_chains(graph, roles, fixed);
  if (reduced.runs.empty()) return reweight(graph, config, roles, fixed, stop);

  // The runs bend little, so the reduced graph decides the same, at a fraction of the cost; then the full one is solved
  // with the decided weights from where the reduced one ended.
  std::vector<std::size_t> reduced_fixed;
  for (const std::size_t i : fixed)
    reduced_fixed.push_back(
        static_cast<std::size_t>(std::ranges::lower_bound(reduced.nodes, i) - reduced.nodes.begin()));
  GncResult out = reweight(reduced.graph, config, reduced.roles, reduced_fixed, stop);
  const std::vector<double> reduced_weight =
      std::exchange(out.inlier_weight, std::vector<double>(graph.edges.size(), 1.0));
  const std::vector<Pose3> reduced_poses = std::exchange(out.solution.poses, graph.poses);
  out.solution.weights = out.inlier_weight;
  if (!is_usable(out.solution.summary.termination)) return out;
  std::vector<double> scale(graph.edges.size(), 1.0);
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (!reduced.edge[e]) continue;
    out.inlier_weight[e] = reduced_weight[*reduced.edge[e]];
    scale[e] = std::max(out.inlier_weight[e], kWeightFloor);
  }
  out.solution.weights = out.inlier_weight;
  expand_chains(graph, reduced, reduced_poses, out.solution.poses);
  const auto structure = internal::analyse_blocks(graph, {}, fixed);
  internal::GraphEquations equations(graph, structure);
  const int before = out.solution.summary.factorisations;
  out.solution.summary = internal::minimise(equations, out.solution.poses, {.loss = {}, .roles = roles, .scale = scale},
                                            config.solver, {.stop = stop});
  out.solution.summary.factorisations += before;
  return out;
}

}  // namespace tutti::estimation
