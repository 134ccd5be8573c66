// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/graph_equations.hpp"

namespace tutti::estimation::internal {

GraphEquations::GraphEquations(const PoseGraph& graph, const BlockStructure& structure)
    : graph_(graph), structure_(structure), hessian_(structure, 6), gradient_(6 * structure.variables) {}

double GraphEquations::cost(std::span<const Pose3> poses, const EdgeCosts& costs) {
  double sum = 0.0;
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto& edge = graph_.edges[e];
    const Vector6d r = between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
    sum += costs.cost(e, r.dot(edge.information * r));
  }
  return sum;
}

void GraphEquations::add_hessian(const EdgeSlot& slot, const BetweenLinearisation& factor,
                                 const Matrix6d& information) {
  const Matrix6d WJ_j = information * factor.J_j;
  if (slot.to >= 0) hessian_.add_diagonal(slot.to, Matrix6d(factor.J_j.transpose() * WJ_j));
  if (slot.from >= 0) {
    const Matrix6d WJ_i = information * factor.J_i;
    hessian_.add_diagonal(slot.from, Matrix6d(factor.J_i.transpose() * WJ_i));
    hessian_.add_edge(slot, Matrix6d(factor.J_i.transpose() * WJ_j));
  }
}

void GraphEquations::linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) {
  gradient_.setZero();
  if (with_hessian) hessian_.set_zero();
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto& edge = graph_.edges[e];
    if (edge.from == edge.to) continue;
    const auto factor = linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to);
    const Vector6d weighted = edge.information * factor.residual;
    const double s = factor.residual.dot(weighted);
    const double weight = costs.weight(e, s);
    const EdgeSlot& slot = structure_.edges[e];
    const Vector6d force = weight * weighted;
    if (slot.from >= 0) gradient_.segment<6>(6 * slot.from).noalias() += factor.J_i.transpose() * force;
    if (slot.to >= 0) gradient_.segment<6>(6 * slot.to).noalias() += factor.J_j.transpose() * force;
    if (!with_hessian) continue;
    Matrix6d information = weight * edge.information;
    if (const double flatter = 1.0 - costs.curvature(e, s); flatter > 0.0)
      information -= (flatter * weight / s) * weighted * weighted.transpose();
    add_hessian(slot, factor, information);
  }
}

}  // namespace tutti::estimation::internal
