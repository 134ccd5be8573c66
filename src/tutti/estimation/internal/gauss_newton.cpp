// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/gauss_newton.hpp"

#include <cmath>
#include <utility>

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation::internal {
namespace {

/// A cost below this (chi2 has no unit) is zero: tolerances relative to it would ask for more digits than there are.
constexpr double kCostFloor = 1e-6;
constexpr int kMaxStepHalvings = 8;
/// Once a step promises less than this share of the cost, the Hessian hardly changes and its factor is used again...
constexpr double kReuseBelow = 1e-2;
/// ...as long as every such step still shrinks the promised decrease by this factor.
constexpr double kReuseContraction = 0.1;
/// Where the poses' steps count, they too must shrink, and the step before the first reuse be no longer than this (m,
/// rad): weak directions, which hardly show in the cost, are where an old factor is wrong first.
constexpr double kReuseStepContraction = 0.3;
constexpr double kReuseStepBelow = 1e-4;
/// The error by rounding in a cost, as a share of it.
constexpr double kRounding = 1e-11;

/// How far a sequence of steps goes on after one of this size, if they keep shrinking as they just did. Nothing is
/// known of the first one's shrinking.
double still_to_go(double size, double previous) {
  return size < 0.5 * previous ? size * size / (previous - size) : size;
}

/// T Exp(xi) in SE(3). Poses that turn together about a far point keep their relative poses, which retract() grants to
/// first order only: a long map that swings about its first pose would have to be straightened by the next step.
Pose3 moved_by(const Pose3& T, const Vector6d& xi) {
  Vector6d step = xi;
  step.head<3>() = so3_right_jacobian(xi.tail<3>()).transpose() * xi.head<3>();
  return retract(T, step);
}

struct Tried {
  double scale;
  double cost;
};
/// Halves the step until it costs at most `most`, or for the last time; `candidate`: the poses after it.
Tried search_line(GraphEquations& equations, const std::vector<Pose3>& poses, const Eigen::VectorXd& step,
                  const EdgeCosts& costs, double most, int max_halvings, std::vector<Pose3>& candidate) {
  for (Tried tried{.scale = 1.0, .cost = 0.0};; tried.scale *= 0.5) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (const int v = equations.variable(i); v >= 0)
        candidate[i] = moved_by(poses[i], tried.scale * step.segment<6>(6 * v));
    tried.cost = equations.cost(candidate, costs);
    if (tried.cost <= most || max_halvings-- == 0) return tried;
  }
}

}  // namespace

SolveSummary minimise(GraphEquations& equations, std::vector<Pose3>& poses, const EdgeCosts& costs,
                      const SolverConfig& config, const Minimising& how) {
  const bool limits_step = std::isfinite(how.step_tolerance);
  SolveSummary summary{.components = equations.components()};
  summary.initial_cost = summary.final_cost = equations.cost(poses, costs);
  summary.termination = Termination::max_iterations;
  std::vector<Pose3> candidate = poses;
  Eigen::VectorXd step;
  const Eigen::VectorXd& gradient = equations.gradient();
  double previous_decrease = 0.0;
  double previous_size = 0.0;
  bool reuse_factor = how.is_factorised;
  bool is_unknown = reuse_factor;  // no step has shown yet what this factor is worth
  while (summary.iterations < config.max_iterations && !(how.stop && how.stop())) {
    equations.linearise(poses, costs, !reuse_factor);
    if (!reuse_factor) ++summary.factorisations;
    if (!reuse_factor && !equations.factorise()) {
      summary.termination = Termination::singular;
      summary.moved_since_factorised = std::numeric_limits<double>::infinity();
      break;
    }
    if (!reuse_factor) summary.moved_since_factorised = 0.0;
    step = -gradient;
    equations.solve(step);
    const double decrease = -step.dot(gradient);  // of the cost, predicted by the linear model
    if (!std::isfinite(decrease)) {
      summary.termination = Termination::singular;
      break;
    }
    const double relative = decrease / (summary.final_cost + kCostFloor);
    const double size = step.size() > 0 ? step.lpNorm<Eigen::Infinity>() : 0.0;
    if (reuse_factor && !is_unknown &&
        (decrease > kReuseContraction * previous_decrease ||
         (limits_step && size > kReuseStepContraction * previous_size))) {
      reuse_factor = false;
      continue;
    }
    ++summary.iterations;
    summary.gradient_norm = gradient.size() > 0 ? gradient.lpNorm<Eigen::Infinity>() : 0.0;

    const double cost_to_go = limits_step ? still_to_go(decrease, previous_decrease) : decrease;
    const bool converged = !is_unknown &&
                           cost_to_go <= config.relative_cost_tolerance * (summary.final_cost + kCostFloor) &&
                           still_to_go(size, previous_size) <= how.step_tolerance;
    previous_decrease = decrease;
    previous_size = size;
    // A step that is asked for by its size may promise less than the cost's rounding.
    const double most = summary.final_cost * (relative <= kRounding && limits_step ? 1.0 + kRounding : 1.0);
    const auto [scale, new_cost] = search_line(equations, poses, step, costs, most, kMaxStepHalvings, candidate);
    if (!(new_cost <= most) && std::exchange(is_unknown, false)) {
      reuse_factor = false;
      continue;
    }
    if (!(new_cost <= most)) {  // not by more than rounding, when converged
      summary.termination = converged ? Termination::converged : Termination::stalled;
      break;
    }
    poses.swap(candidate);
    summary.final_cost = new_cost;
    summary.step_norm = scale * size;
    summary.moved_since_factorised += summary.step_norm;
    if (converged) {
      summary.termination = Termination::converged;
      break;
    }
    is_unknown = false;
    reuse_factor = scale == 1.0 && relative < kReuseBelow && !(limits_step && size > kReuseStepBelow);
  }
  return summary;
}

}  // namespace tutti::estimation::internal
