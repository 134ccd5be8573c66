// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/onboard_smoother.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <span>

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/chain_run.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"

namespace tutti::estimation {
namespace {

Matrix6d inverse(const Matrix6d& covariance) { return covariance.llt().solve(Matrix6d::Identity()); }

/// Positions in the chain of the reduced graph's nodes: the first pose and every constrained one.
std::vector<std::size_t> reduced_nodes(const std::vector<ChainConstraint>& constraints) {
  std::vector<std::size_t> nodes{0};
  nodes.reserve(2 * constraints.size() + 1);
  for (const auto& constraint : constraints) {
    if (constraint.from == constraint.to) continue;
    nodes.push_back(constraint.from);
    nodes.push_back(constraint.to);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::size_t position_of(const std::vector<std::size_t>& nodes, std::size_t node) {
  return static_cast<std::size_t>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
}

}  // namespace

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, const Pose3& first)
    : config_(config), state_{.first = first}, poses_{first} {}

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, SmootherState state)
    : OnboardSmoother(config, state.first) {
  for (const auto& step : state.odometry) append(step);
  set_constraints(std::move(state.constraints));
}

std::size_t OnboardSmoother::append(const RelativePose& odometry) {
  state_.odometry.push_back(odometry);
  poses_.push_back(poses_.back() * odometry.T_a_b);
  return poses_.size() - 1;
}

void OnboardSmoother::set_constraints(std::vector<ChainConstraint> constraints) {
  for (const auto& constraint : constraints)
    TUTTI_CHECK(constraint.from < size() && constraint.to < size(), "constraint {} -> {}, {} nodes", constraint.from,
                constraint.to, size());
  state_.constraints = std::move(constraints);
  constraint_weights_.assign(state_.constraints.size(), 1.0);
}

void OnboardSmoother::set_first_pose(const Pose3& T_map_first) {
  const Pose3 motion = T_map_first * state_.first.inverse();
  for (Pose3& pose : poses_) pose = motion * pose;
  poses_.front() = state_.first = T_map_first;
}

/// The reduced graph about raw odometry: nodes[k] is node k, edge k the run from nodes[k] to nodes[k + 1], then the
/// constraints. `constraint_edges`: position of each constraint's edge.
PoseGraph OnboardSmoother::reduce(const std::vector<std::size_t>& nodes, std::vector<std::size_t>& constraint_edges) {
  PoseGraph graph;
  graph.poses.reserve(nodes.size());
  graph.poses.push_back(state_.first);
  std::map<std::pair<std::size_t, std::size_t>, RelativePose> compounds;
  const std::span<const RelativePose> odometry(state_.odometry);
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const std::pair run{nodes[k], nodes[k + 1]};
    auto node = compounds_.extract(run);
    if (node.empty()) {
      const auto sum = internal::sum_odometry(odometry.subspan(run.first, run.second - run.first));
      const Matrix6d to_end = adjoint(sum.T_a_b.inverse());
      compounds.emplace_hint(compounds.end(), run,
                             RelativePose{sum.T_a_b, to_end * sum.covariance * to_end.transpose()});
    } else {
      compounds.insert(compounds.end(), std::move(node));
    }
    const RelativePose& compound = std::prev(compounds.end())->second;
    graph.poses.push_back(graph.poses.back() * compound.T_a_b);
    graph.edges.push_back({k, k + 1, compound.T_a_b, inverse(compound.covariance)});
  }
  compounds_ = std::move(compounds);
  for (const auto& constraint : state_.constraints) {
    constraint_edges.push_back(graph.edges.size());
    if (constraint.from == constraint.to) continue;
    graph.edges.push_back({position_of(nodes, constraint.from), position_of(nodes, constraint.to),
                           constraint.measurement.T_a_b, inverse(constraint.measurement.covariance)});
  }
  return graph;
}

SmootherSummary OnboardSmoother::solve() {
  SmootherSummary summary;
  const auto nodes = reduced_nodes(state_.constraints);
  std::vector<std::size_t> constraint_edges;
  const PoseGraph graph = reduce(nodes, constraint_edges);
  summary.reduced_nodes = graph.poses.size();
  summary.reduced_edges = graph.edges.size();
  if (!internal::is_finite(graph)) {
    summary.termination = Termination::invalid_input;
    return summary;
  }
  std::vector<EdgeRole> roles(graph.edges.size(), EdgeRole::robust);
  std::fill_n(roles.begin(), nodes.size() - 1, EdgeRole::trusted);
  const internal::EdgeCosts costs{.loss = {loss_kind(config_.loss), config_.loss_scale}, .roles = roles, .scale = {}};
  const auto structure = internal::analyse_blocks(graph);
  internal::GaussNewton gauss_newton(graph, structure);
  std::vector<Pose3> reduced = graph.poses;
  const SolverConfig solver{.max_iterations = config_.max_iterations,
                            .relative_cost_tolerance = config_.relative_cost_tolerance};
  const SolveSummary solved = gauss_newton.minimise(reduced, costs, solver);
  summary.termination = solved.termination;
  summary.iterations = solved.iterations;
  summary.initial_cost = solved.initial_cost;
  summary.final_cost = solved.final_cost;
  if (!is_usable(solved.termination)) return summary;

  distribute(nodes, graph, reduced);
  for (int k = 0; k < config_.polishing_steps; ++k)
    if (!polish(nodes, graph, costs, gauss_newton)) break;
  compose_tail(nodes.back());
  for (std::size_t c = 0; c < state_.constraints.size(); ++c) {
    const auto& constraint = state_.constraints[c];
    if (constraint.from == constraint.to) continue;
    const auto& edge = graph.edges[constraint_edges[c]];
    const Vector6d r = between_residual(poses_[constraint.from], poses_[constraint.to], edge.T_from_to);
    constraint_weights_[c] = costs.weight(constraint_edges[c], r.dot(edge.information * r));
  }
  return summary;
}

/// Inner poses of every run from its ends: the raw odometry, set at the run's begin, bent to meet its end.
void OnboardSmoother::distribute(const std::vector<std::size_t>& nodes, const PoseGraph& graph,
                                 const std::vector<Pose3>& reduced) {
  const std::span<const RelativePose> odometry(state_.odometry);
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const auto& run = graph.edges[k];
    const Vector6d closing = local(reduced[k] * run.T_from_to, reduced[k + 1]);
    const Vector6d lambda = adjoint(run.T_from_to.inverse()).transpose() * (run.information * closing);
    const std::size_t steps = nodes[k + 1] - nodes[k];
    poses_[nodes[k]] = reduced[k];
    internal::distribute_odometry(odometry.subspan(nodes[k], steps), std::span(poses_).subspan(nodes[k], steps + 1),
                                  lambda);
  }
  poses_[nodes.back()] = reduced.back();
}

/// One Gauss-Newton step on the full graph, by eliminating the runs' inner poses about the current poses.
bool OnboardSmoother::polish(const std::vector<std::size_t>& nodes, const PoseGraph& graph,
                             const internal::EdgeCosts& costs, internal::GaussNewton& gauss_newton) {
  const std::span<const RelativePose> odometry(state_.odometry);
  const auto steps_of = [&](std::size_t k) { return odometry.subspan(nodes[k], nodes[k + 1] - nodes[k]); };
  const auto poses_of = [&](std::size_t k) { return std::span(poses_).subspan(nodes[k], nodes[k + 1] - nodes[k] + 1); };
  std::vector<internal::RunSum> sums;
  std::vector<Eigen::LLT<Matrix6d>> factors;
  gauss_newton.start_linearisation();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    sums.push_back(internal::sum_about(steps_of(k), poses_of(k)));
    factors.emplace_back(sums[k].covariance);
    // Ad(T_a_b) delta_b - delta_a - offset ~ N(0, covariance)
    gauss_newton.add_factor(k, {-sums[k].offset, -Matrix6d::Identity(), adjoint(sums[k].T_a_b)},
                            factors[k].solve(Matrix6d::Identity()));
  }
  for (std::size_t e = nodes.size() - 1; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    const auto factor = linearise_between(poses_[nodes[edge.from]], poses_[nodes[edge.to]], edge.T_from_to);
    const double weight = costs.weight(e, factor.residual.dot(edge.information * factor.residual));
    gauss_newton.add_factor(e, factor, weight * edge.information);
  }
  Eigen::VectorXd step;
  if (!gauss_newton.solve_step(step)) return false;

  std::vector<Vector6d> delta(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) delta[k] = gauss_newton.step_of(step, k);
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const Vector6d gap = adjoint(sums[k].T_a_b) * delta[k + 1] - delta[k] - sums[k].offset;
    internal::distribute_about(steps_of(k), poses_of(k), delta[k], factors[k].solve(gap));
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) poses_[nodes[k]] = retract(poses_[nodes[k]], delta[k]);
  return true;
}

void OnboardSmoother::compose_tail(std::size_t last) {
  for (std::size_t k = last; k < state_.odometry.size(); ++k) poses_[k + 1] = poses_[k] * state_.odometry[k].T_a_b;
}

}  // namespace tutti::estimation
