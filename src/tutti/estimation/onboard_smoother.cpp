// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/onboard_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/internal/full_step.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/odometry_runs.hpp"
#include "tutti/estimation/internal/reduced_problem.hpp"

namespace tutti::estimation {
namespace {

/// Every solve ends with a step that moves no pose by more (m, rad), so that where it started does not show.
constexpr double kStepTolerance = 1e-5;
/// Of an edge's rotation: nearer than this to all measurements, the last poses lead to the minimum that raw odometry
/// leads to.
constexpr double kNearby_rad = 0.3;

/// Chi-square by which rounding may seem to raise the cost of the full graph.
constexpr double kCostTolerance = 1e-3;

bool is_nearby(const PoseGraph& graph, const std::vector<Pose3>& poses) {
  const double least = std::cos(0.5 * kNearby_rad);
  return std::ranges::all_of(graph.edges, [&](const PoseGraphEdge& edge) {
    const Eigen::Quaterniond predicted = poses[edge.from].rotation * edge.T_from_to.rotation;
    return std::abs(predicted.dot(poses[edge.to].rotation)) > least;
  });
}

}  // namespace

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, const Pose3& first)
    : config_(config),
      state_{.first = first},
      poses_{first},
      runs_(std::make_unique<internal::OdometryRuns>()),
      problem_(std::make_unique<internal::ReducedProblem>()) {}

OnboardSmoother::OnboardSmoother(const OnboardSmootherConfig& config, SmootherState state)
    : OnboardSmoother(config, state.first) {
  state_.odometry.reserve(state.odometry.size());
  poses_.reserve(state.odometry.size() + 1);
  for (const RelativePose& step : state.odometry) append(step);
  set_constraints(std::move(state.constraints));
}

OnboardSmoother::~OnboardSmoother() = default;
OnboardSmoother::OnboardSmoother(OnboardSmoother&&) noexcept = default;
OnboardSmoother& OnboardSmoother::operator=(OnboardSmoother&&) noexcept = default;

std::size_t OnboardSmoother::stored_runs() const { return runs_->all().size(); }

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
}

void OnboardSmoother::set_first_pose(const Pose3& T_map_first) {
  const Pose3 motion = T_map_first * state_.first.inverse();
  for (Pose3& pose : poses_) pose = motion * pose;
  poses_.front() = state_.first = T_map_first;
}

SmootherSummary OnboardSmoother::solve() {
  SmootherSummary summary;
  auto nodes = internal::reduced_nodes(state_.constraints);
  summary.compounded_steps = runs_->update(nodes, state_.odometry);
  summary.analysed = problem_->update(std::move(nodes), runs_->all(), state_.constraints, state_.first);
  summary.reduced_nodes = problem_->graph().poses.size();
  summary.reduced_edges = problem_->graph().edges.size();
  if (!internal::is_finite(problem_->graph())) {
    summary.termination = Termination::invalid_input;
    return summary;
  }

  std::vector<Pose3> reduced;
  const auto result = minimise(reduced);
  summary.termination = result.termination;
  summary.iterations = result.iterations;
  summary.initial_cost = result.initial_cost;
  summary.final_cost = result.final_cost;
  if (is_usable(summary.termination)) place(reduced, summary);
  return summary;
}

/// From the last poses, or, when these are far off or lead nowhere, from raw odometry.
SolveSummary OnboardSmoother::minimise(std::vector<Pose3>& reduced) {
  const PoseGraph& graph = problem_->graph();
  const auto minimise = [&] {
    const SolverConfig solver{.max_iterations = config_.max_iterations,
                              .relative_cost_tolerance = config_.relative_cost_tolerance};
    return internal::minimise(*problem_, reduced, {}, solver, {.step_tolerance = kStepTolerance});
  };
  for (const std::size_t node : problem_->reduced().nodes) reduced.push_back(poses_[node]);
  if (is_nearby(graph, reduced))
    if (const auto result = minimise(); result.termination == Termination::converged) return result;
  reduced = graph.poses;
  return minimise();
}

/// A step on the full graph, unless it makes matters worse: where odometry knows little of some axes and much of
/// others, Gauss-Newton can lead metres away from where it started.
bool OnboardSmoother::polish() {
  std::vector<Pose3> polished = poses_;
  if (!internal::full_step(*problem_, state_.odometry, polished)) return false;
  const double change = internal::full_cost_change(*problem_, state_.odometry, poses_, polished);
  if (!(change < kCostTolerance)) return false;
  poses_.swap(polished);
  runs_->forget_bends();
  return true;
}

/// Makes every pose of the chain follow the reduced nodes.
void OnboardSmoother::place(const std::vector<Pose3>& reduced, SmootherSummary& summary) {
  const std::size_t last = problem_->reduced().nodes.back();
  const Pose3 last_before = poses_[last];
  summary.bent_poses = runs_->place(reduced, state_.odometry, poses_);
  for (int k = 0; k < config_.polishing_steps && polish(); ++k) ++summary.polishing_steps;
  if (composed_from_ <= last) {
    const Pose3 motion = poses_[last] * last_before.inverse();
    for (std::size_t k = last + 1; k < poses_.size(); ++k) poses_[k] = motion * poses_[k];
  } else {
    for (std::size_t k = last; k < state_.odometry.size(); ++k) poses_[k + 1] = poses_[k] * state_.odometry[k].T_a_b;
  }
  composed_from_ = last;
}

}  // namespace tutti::estimation
