// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/gauss_newton.hpp"

#include <cmath>

#include "tutti/estimation/between_factor.hpp"

namespace tutti::estimation::internal {
namespace {

/// A cost below this (chi2 has no unit) is zero: tolerances relative to it would ask for more digits than there are.
constexpr double kCostFloor = 1e-6;
/// Once a step promises less than this share of the cost, the Hessian hardly changes and its factor is used again...
constexpr double kReuseBelow = 1e-2;
/// ...as long as every such step still shrinks the promised decrease by this factor.
constexpr double kReuseContraction = 0.1;
/// Where the poses' steps count, they too must shrink, and the step before the first reuse be no longer than this (m,
/// rad): weak directions, which hardly show in the cost, are where an old factor is wrong first.
constexpr double kReuseStepContraction = 0.3;
constexpr double kReuseStepBelow = 1e-4;
/// Of a cost, as a share of it.
constexpr double kRounding = 1e-11;

/// How far a sequence of steps goes on after one of this size, if they keep shrinking as they just did. Nothing is
/// known of the first one's shrinking.
double still_to_go(double size, double previous) {
  return size < 0.5 * previous ? size * size / (previous - size) : size;
}

}  // namespace

GaussNewton::GaussNewton(const PoseGraph& graph, const BlockStructure& structure)
    : graph_(graph), structure_(structure), hessian_(structure, 6), gradient_(6 * structure.variables) {}

double GaussNewton::cost(std::span<const Pose3> poses, const EdgeCosts& costs) const {
  double sum = 0.0;
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto& edge = graph_.edges[e];
    const Vector6d r = between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
    sum += costs.cost(e, r.dot(edge.information * r));
  }
  return sum;
}

void GaussNewton::start_linearisation() {
  gradient_.setZero();
  hessian_.set_zero();
}

void GaussNewton::add_gradient(const EdgeSlot& slot, const BetweenLinearisation& factor,
                               const Vector6d& weighted_residual) {
  if (slot.from >= 0) gradient_.segment<6>(6 * slot.from).noalias() += factor.J_i.transpose() * weighted_residual;
  if (slot.to >= 0) gradient_.segment<6>(6 * slot.to).noalias() += factor.J_j.transpose() * weighted_residual;
}

void GaussNewton::add_factor(std::size_t edge, const BetweenLinearisation& factor, const Matrix6d& information) {
  add_gradient(structure_.edges[edge], factor, information * factor.residual);
  add_hessian(structure_.edges[edge], factor, information);
}

void GaussNewton::add_hessian(const EdgeSlot& slot, const BetweenLinearisation& factor, const Matrix6d& information) {
  const Matrix6d WJ_j = information * factor.J_j;
  if (slot.to >= 0) hessian_.add_diagonal(slot.to, Matrix6d(factor.J_j.transpose() * WJ_j));
  if (slot.from >= 0) {
    const Matrix6d WJ_i = information * factor.J_i;
    hessian_.add_diagonal(slot.from, Matrix6d(factor.J_i.transpose() * WJ_i));
    hessian_.add_edge(slot, Matrix6d(factor.J_i.transpose() * WJ_j));
  }
}

bool GaussNewton::solve_step(Eigen::VectorXd& step) {
  if (!hessian_.factorise()) return false;
  step = -gradient_;
  hessian_.solve(step);
  return step.allFinite();
}

Vector6d GaussNewton::step_of(const Eigen::VectorXd& step, std::size_t node) const {
  const int variable = structure_.variable[node];
  return variable < 0 ? Vector6d(Vector6d::Zero()) : Vector6d(step.segment<6>(6 * variable));
}

void GaussNewton::linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) {
  gradient_.setZero();
  if (with_hessian) hessian_.set_zero();
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto& edge = graph_.edges[e];
    if (edge.from == edge.to) continue;
    const auto factor = linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to);
    const Vector6d weighted = edge.information * factor.residual;
    const double s = factor.residual.dot(weighted);
    const double weight = costs.weight(e, s);
    add_gradient(structure_.edges[e], factor, weight * weighted);
    if (!with_hessian) continue;
    Matrix6d information = weight * edge.information;
    if (const double flatter = 1.0 - costs.curvature(e, s); flatter > 0.0)
      information -= (flatter * weight / s) * weighted * weighted.transpose();
    add_hessian(structure_.edges[e], factor, information);
  }
}

GaussNewton::Tried GaussNewton::search_line(const std::vector<Pose3>& poses, const Eigen::VectorXd& step,
                                            const EdgeCosts& costs, double most, int max_halvings,
                                            std::vector<Pose3>& candidate) const {
  for (Tried tried{.scale = 1.0, .cost = 0.0};; tried.scale *= 0.5) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (const int v = structure_.variable[i]; v >= 0)
        candidate[i] = retract(poses[i], tried.scale * step.segment<6>(6 * v));
    tried.cost = cost(candidate, costs);
    if (tried.cost <= most || max_halvings-- == 0) return tried;
  }
}

SolveSummary GaussNewton::minimise(std::vector<Pose3>& poses, const EdgeCosts& costs, const SolverConfig& config,
                                   const Continuation& how) {
  SolveSummary summary{.components = structure_.components};
  summary.initial_cost = summary.final_cost = cost(poses, costs);
  summary.termination = Termination::max_iterations;
  std::vector<Pose3> candidate = poses;
  Eigen::VectorXd step;
  double previous_decrease = 0.0;
  double previous_size = 0.0;
  bool reuse_factor = false;
  while (summary.iterations < config.max_iterations) {
    linearise(poses, costs, !reuse_factor);
    if (!reuse_factor && !hessian_.factorise()) {
      summary.termination = Termination::singular;
      break;
    }
    step = -gradient_;
    hessian_.solve(step);
    const double decrease = -step.dot(gradient_);  // of the cost, predicted by the linear model
    if (!std::isfinite(decrease)) {
      summary.termination = Termination::singular;
      break;
    }
    const double relative = decrease / (summary.final_cost + kCostFloor);
    const double size = step.size() > 0 ? step.lpNorm<Eigen::Infinity>() : 0.0;
    if (reuse_factor && (decrease > kReuseContraction * previous_decrease ||
                         (how.limits_step() && size > kReuseStepContraction * previous_size))) {
      reuse_factor = false;
      continue;
    }
    ++summary.iterations;
    summary.gradient_norm = gradient_.size() > 0 ? gradient_.lpNorm<Eigen::Infinity>() : 0.0;

    const double cost_to_go = how.limits_step() ? still_to_go(decrease, previous_decrease) : decrease;
    const bool converged = cost_to_go <= config.relative_cost_tolerance * (summary.final_cost + kCostFloor) &&
                           still_to_go(size, previous_size) <= how.step_tolerance;
    previous_decrease = decrease;
    previous_size = size;
    // A step that is asked for by its size may promise less than the cost's rounding.
    const double most = summary.final_cost * (relative <= kRounding && how.limits_step() ? 1.0 + kRounding : 1.0);
    const auto [scale, new_cost] = search_line(poses, step, costs, most, config.max_step_halvings, candidate);
    if (!(new_cost <= most)) {  // not by more than rounding, when converged
      summary.termination = converged ? Termination::converged : Termination::stalled;
      break;
    }
    poses.swap(candidate);
    summary.final_cost = new_cost;
    summary.step_norm = scale * size;
    if (converged) {
      summary.termination = Termination::converged;
      break;
    }
    reuse_factor = scale == 1.0 && relative < kReuseBelow && !(how.limits_step() && size > kReuseStepBelow);
  }
  return summary;
}

}  // namespace tutti::estimation::internal
