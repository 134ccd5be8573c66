// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/reduced_problem.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation::internal {
namespace {

/// A factor is linearised again when its residual or its weight, as a share of it, changed by more since. A rotation
/// that no longer fits resists, with the whole map as its lever, where the map should turn freely.
constexpr double kRelinearise_m = 1e-5;
constexpr double kRelinearise_rad = 1e-7;
constexpr double kRelinearise_share = 1e-6;

bool is_same(const Vector6d& a, const Vector6d& b) {
  const Vector6d change = (a - b).cwiseAbs();
  return change.head<3>().maxCoeff() <= kRelinearise_m && change.tail<3>().maxCoeff() <= kRelinearise_rad;
}

}  // namespace

bool ReducedProblem::update(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
                            std::span<const ChainConstraint> constraints, const Pose3& first) {
  std::swap(now_, before_);
  const Carried carried = reduce(std::move(nodes), runs, constraints, first, before_, now_);
  carry_edges(carried);
  const int variables = static_cast<int>(now_.nodes.size()) - 1;
  gradient_.resize(6 * variables);
  relative_.resize(now_.graph.edges.size());
  residual_.resize(now_.graph.edges.size());
  force_.resize(now_.graph.edges.size());
  if (carried.same_pattern()) return false;

  std::vector<int> renumber;
  for (std::size_t k = 1; k < carried.node.size(); ++k) renumber.push_back(carried.node[k] - 1);
  for (int& n : renumber) n = std::max(n, -1);
  std::vector<FrontTree::Pair> pairs;
  pairs.reserve(now_.graph.edges.size());
  for (const auto& edge : now_.graph.edges)
    if (edge.from != 0 && edge.to != 0) pairs.emplace_back(variable(edge.from), variable(edge.to));
  tree_.restructure(variables, renumber, {carried.changed.begin() + 1, carried.changed.end()}, pairs);
  return true;
}

void ReducedProblem::carry_edges(const Carried& carried) {
  const std::size_t edges = carried.edges.size();
  std::vector<char> used(linearised_.size(), 0);
  std::vector<std::size_t> slots(edges, Carried::kNew);
  for (std::size_t e = 0; e < edges; ++e)
    if (carried.edges[e] != Carried::kNew) used[slots[e] = slot_[carried.edges[e]]] = 1;
  std::size_t free = 0;
  for (std::size_t& slot : slots) {
    if (slot != Carried::kNew) continue;
    while (free < used.size() && used[free] != 0) ++free;
    slot = free++;
    if (slot == linearised_.size()) linearised_.emplace_back();
    linearised_[slot].valid = false;
  }
  slot_ = std::move(slots);
  if (linearised_.size() > 2 * edges) {  // far fewer than there were: start again
    linearised_.assign(edges, {});
    std::iota(slot_.begin(), slot_.end(), std::size_t{0});
  }
}

double ReducedProblem::cost(std::span<const Pose3> poses, const EdgeCosts& costs) {
  double sum = 0.0;
  for (std::size_t e = 0; e < now_.graph.edges.size(); ++e) {
    const auto& edge = now_.graph.edges[e];
    relative_[e] = poses[edge.from].inverse() * poses[edge.to];
    residual_[e] = local(edge.T_from_to, relative_[e]);
    force_[e].noalias() = edge.information * residual_[e];
    sum += costs.cost(e, residual_[e].dot(force_[e]));
  }
  return sum;
}

/// J^T force, with the Jacobians of this very relative pose: what acts on one end must balance what acts on the other,
/// or the rest turns the whole map about its weakest direction.
void ReducedProblem::add_gradient(std::size_t e, const Vector6d& force) {
  const PoseGraphEdge& edge = now_.graph.edges[e];
  const Pose3& T = relative_[e];
  const Eigen::Vector3d push = edge.T_from_to.rotation * force.head<3>();  // in the frame of `from`
  const Eigen::Vector3d turn = so3_right_jacobian_inverse(residual_[e].tail<3>()).transpose() * force.tail<3>();
  if (edge.from != 0) {
    auto g = gradient_.segment<6>(6 * variable(edge.from));
    g.head<3>() -= push;
    g.tail<3>() -= T.translation.cross(push) + T.rotation * turn;
  }
  if (edge.to != 0) {
    auto g = gradient_.segment<6>(6 * variable(edge.to));
    g.head<3>() += T.rotation.conjugate() * push;
    g.tail<3>() += turn;
  }
}

void ReducedProblem::linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) {
  gradient_.setZero();
  for (std::size_t e = 0; e < now_.graph.edges.size(); ++e) {
    const double s = residual_[e].dot(force_[e]);
    const double weight = costs.weight(e, s);
    const double flatter = std::max(0.0, 1.0 - costs.curvature(e, s));
    add_gradient(e, weight * force_[e]);
    if (!with_hessian) continue;
    Linearised& at = linearised_[slot_[e]];
    if (at.valid && std::abs(at.weight - weight) <= kRelinearise_share * weight &&
        std::abs(at.flatter - flatter) <= kRelinearise_share && is_same(residual_[e], at.residual))
      continue;
    const auto& edge = now_.graph.edges[e];
    Matrix6d information = weight * edge.information;
    if (flatter > 0.0) information -= (flatter * weight / s) * force_[e] * force_[e].transpose();
    linearise(e, linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to), information);
    at.valid = true;
    at.residual = residual_[e];
    at.weight = weight;
    at.flatter = flatter;
  }
}

void ReducedProblem::linearise(std::size_t edge, const BetweenLinearisation& linear, const Matrix6d& information) {
  Linearised& at = linearised_[slot_[edge]];
  const Matrix6d WJ_from = information * linear.J_i;
  at.from_from.noalias() = linear.J_i.transpose() * WJ_from;
  at.to_from.noalias() = linear.J_j.transpose() * WJ_from;
  at.to_to.noalias() = linear.J_j.transpose() * (information * linear.J_j);
  at.valid = false;
  for (const std::size_t node : {now_.graph.edges[edge].from, now_.graph.edges[edge].to})
    if (node != 0) tree_.touch(variable(node));
}

void ReducedProblem::start_linearisation() { gradient_.setZero(); }

void ReducedProblem::set_factor(std::size_t edge, const BetweenLinearisation& linear, const Matrix6d& information) {
  linearise(edge, linear, information);
  const Vector6d force = information * linear.residual;
  const auto& ends = now_.graph.edges[edge];
  if (ends.from != 0) gradient_.segment<6>(6 * variable(ends.from)).noalias() += linear.J_i.transpose() * force;
  if (ends.to != 0) gradient_.segment<6>(6 * variable(ends.to)).noalias() += linear.J_j.transpose() * force;
}

bool ReducedProblem::factorise() {
  return tree_.factorise([this](int variable, FrontTree::Column& column) { assemble(variable, column); });
}

void ReducedProblem::assemble(int variable, FrontTree::Column& column) {
  const std::size_t node = static_cast<std::size_t>(variable) + 1;
  for (const auto& [other, edge] : now_.incident_to(node)) {
    const Linearised& blocks = linearised_[slot_[edge]];
    const bool is_from = now_.graph.edges[edge].from == node;
    column.add_diagonal(is_from ? blocks.from_from : blocks.to_to);
    if (other == 0 || !column.takes(other - 1)) continue;
    if (is_from)
      column.add(other - 1, blocks.to_from);
    else
      column.add(other - 1, blocks.to_from.transpose());
  }
}

}  // namespace tutti::estimation::internal
