// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/full_step.hpp"

#include <Eigen/Cholesky>

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/chain_run.hpp"

namespace tutti::estimation::internal {

bool full_step(ReducedProblem& problem, const EdgeCosts& costs, std::span<const RelativePose> odometry,
               std::span<Pose3> poses) {
  const auto& [nodes, graph, roles, edges] = problem.reduced();
  GaussNewton& gauss_newton = problem.gauss_newton();
  const auto steps_of = [&, &n = nodes](std::size_t k) { return odometry.subspan(n[k], n[k + 1] - n[k]); };
  const auto poses_of = [&, &n = nodes](std::size_t k) { return poses.subspan(n[k], n[k + 1] - n[k] + 1); };
  std::vector<RunSum> sums;
  std::vector<Eigen::LLT<Matrix6d>> factors;
  sums.reserve(nodes.size());
  factors.reserve(nodes.size());
  gauss_newton.start_linearisation();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    sums.push_back(sum_about(steps_of(k), poses_of(k)));
    factors.emplace_back(sums[k].covariance);
    // Ad(T_a_b) delta_b - delta_a - offset ~ N(0, covariance)
    gauss_newton.add_factor(k, {-sums[k].offset, -Matrix6d::Identity(), adjoint(sums[k].T_a_b)},
                            factors[k].solve(Matrix6d::Identity()));
  }
  for (std::size_t e = nodes.size() - 1; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    const auto factor = linearise_between(poses[nodes[edge.from]], poses[nodes[edge.to]], edge.T_from_to);
    const double weight = costs.weight(e, factor.residual.dot(edge.information * factor.residual));
    gauss_newton.add_factor(e, factor, weight * edge.information);
  }
  Eigen::VectorXd step;
  if (!gauss_newton.solve_step(step)) return false;

  std::vector<Vector6d> delta(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) delta[k] = gauss_newton.step_of(step, k);
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const Vector6d gap = adjoint(sums[k].T_a_b) * delta[k + 1] - delta[k] - sums[k].offset;
    distribute_about(steps_of(k), poses_of(k), delta[k], factors[k].solve(gap));
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) poses[nodes[k]] = retract(poses[nodes[k]], delta[k]);
  return true;
}

}  // namespace tutti::estimation::internal
