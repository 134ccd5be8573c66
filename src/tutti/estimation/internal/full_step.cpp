// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/full_step.hpp"

#include <Eigen/Cholesky>

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/chain_run.hpp"

namespace tutti::estimation::internal {

bool full_step(ReducedProblem& problem, std::span<const RelativePose> odometry, std::span<Pose3> poses) {
  const auto& nodes = problem.reduced().nodes;
  const auto& graph = problem.reduced().graph;
  const auto steps_of = [&](std::size_t k) { return odometry.subspan(nodes[k], nodes[k + 1] - nodes[k]); };
  const auto poses_of = [&](std::size_t k) { return poses.subspan(nodes[k], nodes[k + 1] - nodes[k] + 1); };
  std::vector<RunSum> sums;
  std::vector<Eigen::LLT<Matrix6d>> factors;
  sums.reserve(nodes.size());
  factors.reserve(nodes.size());
  problem.start_linearisation();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    sums.push_back(sum_about(steps_of(k), poses_of(k)));
    factors.emplace_back(sums[k].covariance);
    // Ad(T_a_b) delta_b - delta_a - offset ~ N(0, covariance)
    problem.set_factor(k, {-sums[k].offset, -Matrix6d::Identity(), adjoint(sums[k].T_a_b)},
                       factors[k].solve(Matrix6d::Identity()));
  }
  for (std::size_t e = nodes.size() - 1; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    const auto factor = linearise_between(poses[nodes[edge.from]], poses[nodes[edge.to]], edge.T_from_to);
    problem.set_factor(e, factor, edge.information);
  }
  if (!problem.factorise()) return false;
  Eigen::VectorXd step = -problem.gradient();
  problem.solve(step);
  if (!step.allFinite()) return false;

  std::vector<Vector6d> delta(nodes.size(), Vector6d::Zero());
  for (std::size_t k = 1; k < nodes.size(); ++k) delta[k] = step.segment<6>(6 * problem.variable(k));
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const Vector6d gap = adjoint(sums[k].T_a_b) * delta[k + 1] - delta[k] - sums[k].offset;
    distribute_about(steps_of(k), poses_of(k), delta[k], factors[k].solve(gap));
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) poses[nodes[k]] = retract(poses[nodes[k]], delta[k]);
  return true;
}

double full_cost_change(const ReducedProblem& problem, std::span<const RelativePose> odometry,
                        std::span<const Pose3> before, std::span<const Pose3> after) {
  const auto& nodes = problem.reduced().nodes;
  const auto& graph = problem.reduced().graph;
  double change = 0.0;
  for (std::size_t i = 0; i < nodes.back(); ++i) {
    const Eigen::LLT<Matrix6d> factor(odometry[i].covariance);
    Eigen::Matrix<double, 6, 2> r;
    r.col(0) = between_residual(before[i], before[i + 1], odometry[i].T_a_b);
    r.col(1) = between_residual(after[i], after[i + 1], odometry[i].T_a_b);
    factor.matrixL().solveInPlace(r);
    change += r.col(1).squaredNorm() - r.col(0).squaredNorm();
  }
  const auto cost = [&](std::size_t e, std::span<const Pose3> poses) {
    const PoseGraphEdge& edge = graph.edges[e];
    const Vector6d r = between_residual(poses[nodes[edge.from]], poses[nodes[edge.to]], edge.T_from_to);
    return r.dot(edge.information * r);
  };
  for (std::size_t e = nodes.size() - 1; e < graph.edges.size(); ++e) change += cost(e, after) - cost(e, before);
  return change;
}

}  // namespace tutti::estimation::internal
