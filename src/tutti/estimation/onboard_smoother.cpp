// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/onboard_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/reduced_chain.hpp"

namespace tutti::estimation {
namespace {

/// Every solve ends with a step that moves no pose by more (m, rad), so that where it started does not show.
constexpr double kStepTolerance = 1e-5;
/// When every edge's rotation is nearer than this to its measurement, the last poses lead to the same minimum as raw
/// odometry.
constexpr double kNearby_rad = 0.3;

bool is_nearby(const PoseGraph& graph, const std::vector<Pose3>& poses) {
  const double least = std::cos(0.5 * kNearby_rad);
  return std::ranges::all_of(graph.edges, [&](const PoseGraphEdge& edge) {
    const Eigen::Quaterniond predicted = poses[edge.from].rotation * edge.T_from_to.rotation;
    return std::abs(predicted.dot(poses[edge.to].rotation)) > least;
  });
}

}  // namespace

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, const Pose3& first)
    : config_(config), state_{.first = first, .odometry = {}, .constraints = {}, .poses = std::vector<Pose3>{first}} {}

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, SmootherState state)
    : OnboardSmoother(config, state.first) {
  for (const RelativePose& step : state.odometry) append(step);
  set_constraints(std::move(state.constraints));
  TUTTI_CHECK(state.poses.size() <= size() && state.held <= size(), "{} poses, {} held, of {} nodes",
              state.poses.size(), state.held, size());
  state_.solution.clear();
  state_.held = state.held;
  if (state.poses.empty()) {
    restore_solution(std::move(state.solution));
    return;
  }
  state_.solution = std::move(state.solution);
  for (std::size_t k = 0; k < state.poses.size(); ++k) state_.poses.set(k, state.poses[k]);
  compose_from(state.poses.size() - 1);
}

/// As solve() did after it had found it.
void OnboardSmoother::restore_solution(std::vector<Pose3> solution) {
  if (solution.empty()) return;
  const auto nodes = internal::reduced_nodes(state_.constraints);
  TUTTI_CHECK(solution.size() == nodes.size(), "a solution of {} poses, {} nodes", solution.size(), nodes.size());
  internal::update_runs(nodes, state_.odometry, runs_);
  PoseGraph graph = internal::reduced_graph(nodes, runs_, state_.constraints, state_.first);
  state_.solution = std::move(solution);
  if (!internal::is_finite(graph)) return;
  const auto structure = internal::analyse_blocks(graph);
  internal::GraphEquations equations(graph, structure);
  spread(nodes, graph, equations);
}

std::size_t OnboardSmoother::solution_size(const std::vector<ChainConstraint>& constraints) {
  return internal::reduced_nodes(constraints).size();
}

int OnboardSmoother::spread(const std::vector<std::size_t>& nodes, PoseGraph& graph,
                            internal::GraphEquations& equations) {
  internal::place(runs_, state_.solution, state_.odometry, state_.poses);
  int steps = 0;
  while (steps < config_.polishing_steps && internal::polish(nodes, state_.odometry, graph, equations, state_.poses))
    ++steps;
  compose_from(nodes.back());
  return steps;
}

void OnboardSmoother::compose_from(std::size_t node) {
  Pose3 pose = state_.poses[node];
  for (std::size_t k = node; k < state_.odometry.size(); ++k)
    state_.poses.set(k + 1, pose = pose * state_.odometry[k].T_a_b);
}

std::size_t OnboardSmoother::append(const RelativePose& odometry) {
  state_.odometry.push_back(odometry);
  state_.poses.push_back(state_.poses.back() * odometry.T_a_b);
  return state_.poses.size() - 1;
}

void OnboardSmoother::set_constraints(std::vector<ChainConstraint> constraints) {
  for (const auto& constraint : constraints)
    TUTTI_CHECK(constraint.from < size() && constraint.to < size(), "constraint {} -> {}, {} nodes", constraint.from,
                constraint.to, size());
  if (constraints != state_.constraints) hold();
  state_.constraints = std::move(constraints);
}

/// The poses are no longer those of a solution.
void OnboardSmoother::hold() {
  state_.solution.clear();
  state_.held = size();
}

void OnboardSmoother::set_first_pose(const Pose3& T_map_first) {
  const Pose3 motion = T_map_first * state_.first.inverse();
  if (size() > 1) hold();
  for (std::size_t k = 1; k < size(); ++k) state_.poses.set(k, motion * state_.poses[k]);
  state_.first = T_map_first;
  state_.poses.set(0, T_map_first);
}

SmootherSummary OnboardSmoother::solve() {
  SmootherSummary summary;
  const auto nodes = internal::reduced_nodes(state_.constraints);
  summary.compounded_steps = internal::update_runs(nodes, state_.odometry, runs_);
  PoseGraph graph = internal::reduced_graph(nodes, runs_, state_.constraints, state_.first);
  summary.reduced_nodes = graph.poses.size();
  summary.reduced_edges = graph.edges.size();
  if (!internal::is_finite(graph)) {
    summary.termination = Termination::invalid_input;
    return summary;
  }

  const auto structure = internal::analyse_blocks(graph);
  internal::GraphEquations equations(graph, structure);
  std::vector<Pose3> reduced;
  for (const std::size_t node : nodes) reduced.push_back(state_.poses[node]);
  const auto minimise = [&] {
    const SolverConfig solver{.max_iterations = config_.max_iterations,
                              .relative_cost_tolerance = config_.relative_cost_tolerance};
    return internal::minimise(equations, reduced, {}, solver, {.step_tolerance = kStepTolerance});
  };
  // From the last poses, or, when these are far off or lead nowhere, from raw odometry.
  SolveSummary result;
  if (is_nearby(graph, reduced)) result = minimise();
  if (result.termination != Termination::converged) {
    reduced = graph.poses;
    result = minimise();
  }
  summary.termination = result.termination;
  summary.iterations = result.iterations;
  summary.initial_cost = result.initial_cost;
  summary.final_cost = result.final_cost;
  if (!is_usable(summary.termination)) return summary;
  state_.solution = std::move(reduced);
  state_.held = 0;
  summary.polishing_steps = spread(nodes, graph, equations);
  return summary;
}

}  // namespace tutti::estimation
