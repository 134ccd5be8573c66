// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/switched_graph.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation {
namespace {

/// An edge that is out keeps this weight, so that what it alone would join stays determined.
constexpr double kOut = 1e-8;
/// Less than this share of what is known of a direction comes from elsewhere: nothing does.
constexpr double kNothingElse = 1e-9;

/// Poses that moved by no more than this (m, rad) since then still have the covariances of an earlier factor.
constexpr double kStill = 1e-3;

/// Where the first solution begins is solved to this share of its cost.
constexpr double kRoughly = 1e-3;

using internal::SelectedInverse;

/// `covariance`: H^-1 at the edge's ends.
double price(const PoseGraphEdge& edge, const BetweenLinearisation& factor,
             const Eigen::Matrix<double, 12, 12>& covariance, bool is_in) {
  const Matrix6d upper = root_of_information(edge.information);  // Omega = upper^T upper
  Eigen::Matrix<double, 6, 12> J;
  J << upper * factor.J_i, upper * factor.J_j;
  const Eigen6 known = eigen_of(Matrix6d(J * covariance * J.transpose()));
  const Vector6d missed = known.vectors.transpose() * (upper * factor.residual);
  double out = 0.0;
  for (int d = 0; d < 6; ++d) {
    const double share = std::max(0.0, known.values(d));
    const double rest = is_in ? 1.0 - share : 1.0 + share;
    if (rest > kNothingElse) out += missed(d) * missed(d) / rest;
  }
  return out;
}

}  // namespace

struct SwitchedGraph::State {
  const PoseGraph& graph;
  SolverConfig config;
  std::vector<EdgeRole> roles;
  ReducedGraph reduced;
  internal::BlockStructure structure;
  std::unique_ptr<internal::GraphEquations> equations;
  std::vector<double> scale;  // per reduced edge
  std::vector<Pose3> poses;   // of reduced nodes
  bool solved = false;
  double cost = 0.0;
  int factorisations = 0;
  /// How far poses moved since the equations were factorised, m or rad; infinite when their factor was taken.
  double moved = std::numeric_limits<double>::infinity();

  [[nodiscard]] internal::EdgeCosts costs() const { return {.loss = {}, .roles = {}, .scale = scale}; }
  PoseGraphSolution from_measurements();
  Termination begin();
};

/// The rough solution of what is in, from its measurements alone.
PoseGraphSolution SwitchedGraph::State::from_measurements() {
  PoseGraph only{.poses = reduced.graph.poses, .edges = {}};
  for (std::size_t e = 0; e < reduced.graph.edges.size(); ++e)
    if (scale[e] == 1.0) only.edges.push_back(reduced.graph.edges[e]);
  SolverConfig roughly = config;
  roughly.initialisation = "chordal";
  roughly.relative_cost_tolerance = std::max(kRoughly, roughly.relative_cost_tolerance);
  PoseGraphSolution start = solve_pose_graph(only, roughly);
  factorisations += start.summary.factorisations;
  return start;
}

/// Where the first solution begins: as given, or at the rough solution of what is in.
Termination SwitchedGraph::State::begin() {
  if (config.initialisation == "given") {
    poses = reduced.graph.poses;
    return internal::is_finite(reduced.graph) ? Termination::converged : Termination::invalid_input;
  }
  PoseGraphSolution start = from_measurements();
  if (is_usable(start.summary.termination)) poses = std::move(start.poses);
  return start.summary.termination;
}

SwitchedGraph::SwitchedGraph(const PoseGraph& graph, std::span<const EdgeRole> roles, const SolverConfig& config)
    : state_(std::make_unique<State>(State{.graph = graph, .config = config, .roles = {roles.begin(), roles.end()}})) {
  TUTTI_CHECK(roles.size() == graph.edges.size(), "{} roles, {} edges", roles.size(), graph.edges.size());
  State& s = *state_;
  s.config.loss = {};
  s.reduced = reduce_chains(graph, roles);
  s.structure = internal::analyse_blocks(s.reduced.graph);
  s.equations = std::make_unique<internal::GraphEquations>(s.reduced.graph, s.structure);
  s.scale.assign(s.reduced.graph.edges.size(), 1.0);
}
SwitchedGraph::~SwitchedGraph() = default;

Termination SwitchedGraph::solve(const std::vector<char>& in) {
  State& s = *state_;
  TUTTI_CHECK(in.size() == s.roles.size(), "{} switches, {} edges", in.size(), s.roles.size());
  for (std::size_t e = 0; e < in.size(); ++e)
    if (s.roles[e] == EdgeRole::robust) s.scale[*s.reduced.edge[e]] = in[e] ? 1.0 : kOut;
  if (!s.solved) {
    if (const Termination begun = s.begin(); !is_usable(begun)) return begun;
  }
  const SolveSummary summary = internal::minimise(*s.equations, s.poses, s.costs(), s.config);
  s.factorisations += summary.factorisations;
  s.cost = summary.final_cost;
  s.moved = summary.moved_since_factorised;
  s.solved = is_usable(summary.termination);
  return summary.termination;
}

bool SwitchedGraph::improve_from_measurements() {
  State& s = *state_;
  TUTTI_CHECK(s.solved, "solve() comes first");
  PoseGraphSolution other = s.from_measurements();
  if (!is_usable(other.summary.termination)) return false;
  std::vector<Pose3> poses = std::exchange(s.poses, std::move(other.poses));
  const SolveSummary summary = internal::minimise(*s.equations, s.poses, s.costs(), s.config);
  s.factorisations += summary.factorisations;
  s.moved = std::numeric_limits<double>::infinity();  // the equations are factorised at the other solution
  if (!is_usable(summary.termination) || !is_cheaper(summary.final_cost, s.cost)) {
    s.poses = std::move(poses);
    return false;
  }
  s.cost = summary.final_cost;
  s.moved = summary.moved_since_factorised;
  return true;
}

std::vector<double> SwitchedGraph::prices() {
  State& s = *state_;
  std::vector<double> out(s.roles.size(), 0.0);
  DisjointSets parts(s.reduced.graph.poses.size());
  for (std::size_t e = 0; e < s.reduced.graph.edges.size(); ++e)
    if (s.scale[e] == 1.0) parts.join(s.reduced.graph.edges[e].from, s.reduced.graph.edges[e].to);
  const std::vector<int> part = parts.labels().first;
  if (s.structure.variables == 0) return out;
  if (s.moved > kStill) {
    s.equations->linearise(s.poses, s.costs(), true);
    ++s.factorisations;
    if (!s.equations->factorise()) return {};
  }
  s.moved = std::numeric_limits<double>::infinity();
  const SelectedInverse inverse(s.equations->hessian().take_factor());
  for (std::size_t e = 0; e < out.size(); ++e) {
    if (s.roles[e] != EdgeRole::robust) continue;
    const std::size_t at = *s.reduced.edge[e];
    const PoseGraphEdge& edge = s.reduced.graph.edges[at];
    const bool is_in = s.scale[at] == 1.0;
    if (!is_in && part[edge.from] != part[edge.to]) {
      out[e] = std::numeric_limits<double>::infinity();
      continue;
    }
    const auto factor = linearise_between(s.poses[edge.from], s.poses[edge.to], edge.T_from_to);
    out[e] = price(edge, factor, inverse.ends(s.structure.edges[at]), is_in);
  }
  return out;
}

std::vector<Pose3> SwitchedGraph::poses() const {
  std::vector<Pose3> out = state_->graph.poses;
  if (!state_->poses.empty()) expand_chains(state_->graph, state_->reduced, state_->poses, out);
  return out;
}
double SwitchedGraph::cost() const { return state_->cost; }
int SwitchedGraph::factorisations() const { return state_->factorisations; }

}  // namespace tutti::estimation
