// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/influence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"

namespace tutti::estimation {
namespace {

using internal::BlockStructure;
using internal::EdgeSlot;
using internal::SelectedInverse;
using Matrix6x12d = Eigen::Matrix<double, 6, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

/// Less than this share of what is known of a direction comes from elsewhere: nothing does.
constexpr double kAlone = 1e-9;
/// Less than this share comes from elsewhere: where that would have its ends is not known to first order.
constexpr double kHardlyKnown = 1e-4;

/// H^-1 at the ends of an edge; anchored ends do not move.
Eigen::Matrix<double, 12, 12> covariance_of_ends(const SelectedInverse& inverse, const EdgeSlot& slot) {
  Eigen::Matrix<double, 12, 12> out = Eigen::Matrix<double, 12, 12>::Zero();
  if (slot.from >= 0) out.topLeftCorner<6, 6>() = inverse.block(slot.from, slot.from);
  if (slot.to >= 0) out.bottomRightCorner<6, 6>() = inverse.block(slot.to, slot.to);
  if (slot.from >= 0 && slot.to >= 0) {
    out.topRightCorner<6, 6>() = inverse.block(slot.from, slot.to);
    out.bottomLeftCorner<6, 6>() = out.topRightCorner<6, 6>().transpose();
  }
  return out;
}

/// The force on its ends that has the effect of taking the edge away.
struct Pull {
  std::size_t edge = 0;
  double distance = 0.0;
  Vector12d force;  ///< shift = H^-1 force
};

Pull pull_of(std::size_t e, const PoseGraphEdge& edge, std::span<const Pose3> poses,
             const Eigen::Matrix<double, 12, 12>& covariance) {
  const BetweenLinearisation factor = linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to);
  const Matrix6d root = edge.information.llt().matrixL();  // Omega = root root^T
  Matrix6x12d J;
  J << factor.J_i, factor.J_j;
  const Matrix6x12d whitened = root.transpose() * J;
  const Matrix6d own = whitened * covariance * whitened.transpose();  // of 1 in all: the share that the edge knows
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(own);
  Vector6d missed = eigen.eigenvectors().transpose() * (root.transpose() * factor.residual);
  for (int d = 0; d < 6; ++d) {
    const double others = 1.0 - eigen.eigenvalues()(d);
    missed(d) = others > kAlone ? missed(d) / others : 0.0;
  }
  const Vector6d w = eigen.eigenvectors() * missed;
  return {e, std::sqrt(std::max(0.0, w.dot(own * w))), whitened.transpose() * w};
}

/// An edge in the units of its own standard deviations.
struct Whitened {
  EdgeSlot slot;
  int component = 0;  ///< The graph's component that its ends are in.
  Vector6d residual;
  Matrix6d J_from;
  Matrix6d J_to;
};

Whitened whiten(const PoseGraphEdge& edge, const EdgeSlot& slot, int component, std::span<const Pose3> poses) {
  const BetweenLinearisation factor = linearise_between(poses[edge.from], poses[edge.to], edge.T_from_to);
  const Matrix6d upper = edge.information.llt().matrixU();
  return {slot, component, upper * factor.residual, upper * factor.J_i, upper * factor.J_j};
}

/// J_a H^-1 J_b^T of two edges; nothing joins those of two components, whose blocks are in no pattern.
Matrix6d known_together(const Whitened& a, const Whitened& b, const SelectedInverse& inverse) {
  Matrix6d out = Matrix6d::Zero();
  if (a.component != b.component) return out;
  for (const auto& [i, J_i] : {std::pair(a.slot.from, &a.J_from), std::pair(a.slot.to, &a.J_to)})
    for (const auto& [j, J_j] : {std::pair(b.slot.from, &b.J_from), std::pair(b.slot.to, &b.J_to)})
      if (i >= 0 && j >= 0) out += *J_i * inverse.block(i, j) * J_j->transpose();
  return out;
}

using Group = std::vector<Whitened>;

/// K = J H^-1 J^T of a group, of 1 in all: what the group knows of itself.
Eigen::MatrixXd known_of(const Group& group, const SelectedInverse& inverse) {
  const auto edges = static_cast<Eigen::Index>(group.size());
  Eigen::MatrixXd K(6 * edges, 6 * edges);
  for (Eigen::Index a = 0; a < edges; ++a)
    for (Eigen::Index b = 0; b < edges; ++b)
      K.block<6, 6>(6 * a, 6 * b) =
          known_together(group[static_cast<std::size_t>(a)], group[static_cast<std::size_t>(b)], inverse);
  return K;
}

Eigen::VectorXd residual_of(const Group& group) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(6 * group.size()));
  for (std::size_t a = 0; a < group.size(); ++a) out.segment<6>(static_cast<Eigen::Index>(6 * a)) = group[a].residual;
  return out;
}

/// 1 - K
Eigen::LDLT<Eigen::MatrixXd> of_others(const Eigen::MatrixXd& K) {
  Eigen::MatrixXd others = -0.5 * (K + K.transpose());
  others.diagonal().array() += 1.0 + kAlone;
  return Eigen::LDLT<Eigen::MatrixXd>(others);
}

double misfit(const Group& group, const SelectedInverse& inverse) {
  const Eigen::MatrixXd K = known_of(group, inverse);
  const Eigen::Index middle = 6 * static_cast<Eigen::Index>(group.size() / 2);
  Eigen::MatrixXd right(K.rows(), 7);  // (I - K)^-1 of the residuals, and of K's columns at the middle edge
  right << residual_of(group), K.middleCols<6>(middle);
  const Eigen::LDLT<Eigen::MatrixXd> factor = of_others(K);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return 0.0;
  const Eigen::MatrixXd solved = factor.solve(right);
  const Vector6d moved = K.middleRows<6>(middle) * solved.col(0);
  const Matrix6d covariance = solved.middleRows<6>(middle).rightCols<6>();
  return std::max(0.0, moved.dot(Matrix6d(0.5 * (covariance + covariance.transpose())).ldlt().solve(moved)));
}

/// The normal equations at the optimum, factorised, of the graph without what only passes odometry on, and the groups
/// in it.
struct GroupEquations {
  GroupEquations(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                 std::span<const std::vector<std::size_t>> groups, std::span<const std::size_t> nodes)
      : reduced(reduce_chains(graph, roles, nodes, poses)) {
    for (const std::size_t node : reduced.nodes) at.push_back(poses[node]);
    std::vector<std::pair<std::size_t, std::size_t>> pairs;  // every end of a group with every other
    for (const auto& group : groups)
      for (const std::size_t a : group)
        for (const std::size_t b : group) {
          const PoseGraphEdge& x = edge(a);
          const PoseGraphEdge& y = edge(b);
          pairs.insert(pairs.end(), {{x.from, y.from}, {x.from, y.to}, {x.to, y.to}});
        }
    structure = internal::analyse_blocks(reduced.graph, pairs);
    equations = std::make_unique<internal::GraphEquations>(reduced.graph, structure);
    equations->linearise(at, {}, true);
    is_determined = structure.variables > 0 && equations->factorise();
  }
  GroupEquations(const GroupEquations&) = delete;  // parts refer to each other
  GroupEquations& operator=(const GroupEquations&) = delete;
  [[nodiscard]] std::size_t position(std::size_t e) const {
    TUTTI_CHECK(e < reduced.edge.size() && reduced.edge[e], "edge {} of {}", e, reduced.edge.size());
    return *reduced.edge[e];
  }
  [[nodiscard]] const PoseGraphEdge& edge(std::size_t e) const { return reduced.graph.edges[position(e)]; }
  [[nodiscard]] Group whitened(std::span<const std::size_t> group) const {
    Group out;
    for (const std::size_t e : group)
      out.push_back(whiten(edge(e), structure.edges[position(e)], structure.component[edge(e).from], at));
    return out;
  }

  ReducedGraph reduced;
  std::vector<Pose3> at;  // of reduced nodes
  BlockStructure structure;
  std::unique_ptr<internal::GraphEquations> equations;
  bool is_determined = false;
};

}  // namespace

std::vector<Influence> largest_influences(const PoseGraph& graph, std::span<const Pose3> poses,
                                          std::span<const std::size_t> candidates, std::size_t count,
                                          double least_distance) {
  TUTTI_CHECK(poses.size() == graph.poses.size(), "{} poses, {} nodes", poses.size(), graph.poses.size());
  if (candidates.empty() || count == 0) return {};
  std::vector<EdgeRole> roles(graph.edges.size(), EdgeRole::trusted);
  for (const std::size_t e : candidates) {
    TUTTI_CHECK(e < graph.edges.size(), "edge {} of {}", e, graph.edges.size());
    roles[e] = EdgeRole::robust;
  }
  const ReducedGraph reduced = reduce_chains(graph, roles, {}, poses);
  std::vector<Pose3> at;
  for (const std::size_t node : reduced.nodes) at.push_back(poses[node]);
  const BlockStructure structure = internal::analyse_blocks(reduced.graph);
  internal::GraphEquations equations(reduced.graph, structure);
  equations.linearise(at, {}, true);
  if (structure.variables == 0 || !equations.hessian().factorise()) return {};
  std::vector<Pull> pulls;
  {  // the inverse is as large as the factor, and goes before the shifts come
    const SelectedInverse inverse(equations.hessian().factor().copy());
    for (const std::size_t e : candidates) {
      const EdgeSlot& slot = structure.edges[*reduced.edge[e]];
      Pull pull = pull_of(e, graph.edges[e], poses, covariance_of_ends(inverse, slot));
      if (pull.distance > least_distance) pulls.push_back(std::move(pull));
    }
  }
  if (pulls.empty()) return {};
  std::ranges::stable_sort(pulls, std::greater(), &Pull::distance);
  pulls.resize(std::min(count, pulls.size()));

  Eigen::MatrixXd shifts = Eigen::MatrixXd::Zero(6 * structure.variables, static_cast<Eigen::Index>(pulls.size()));
  for (std::size_t k = 0; k < pulls.size(); ++k) {
    const EdgeSlot& slot = structure.edges[*reduced.edge[pulls[k].edge]];
    auto column = shifts.col(static_cast<Eigen::Index>(k));
    if (slot.from >= 0) column.segment<6>(6 * slot.from) = pulls[k].force.head<6>();
    if (slot.to >= 0) column.segment<6>(6 * slot.to) = pulls[k].force.tail<6>();
  }
  equations.hessian().solve(shifts);

  Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * reduced.nodes.size()), shifts.cols());
  for (std::size_t node = 0; node < reduced.nodes.size(); ++node)
    if (const int v = structure.variable[node]; v >= 0)
      moves.middleRows<6>(static_cast<Eigen::Index>(6 * node)) = shifts.middleRows<6>(6 * v);
  moves = expand_moves(graph, reduced, poses, moves);
  std::vector<Influence> out;
  for (std::size_t k = 0; k < pulls.size(); ++k)
    out.push_back({pulls[k].edge, pulls[k].distance, moves.col(static_cast<Eigen::Index>(k))});
  return out;
}

std::vector<double> group_misfits(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                                  std::span<const std::vector<std::size_t>> groups) {
  std::vector<double> out(groups.size(), 0.0);
  if (groups.empty()) return out;
  GroupEquations equations(graph, poses, roles, groups, {});
  if (!equations.is_determined) return out;
  const SelectedInverse inverse(equations.equations->hessian().take_factor());
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (!groups[g].empty()) out[g] = misfit(equations.whitened(groups[g]), inverse);
  return out;
}

Eigen::MatrixXd group_removals(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                               std::span<const std::vector<std::size_t>> groups, std::span<const std::size_t> nodes) {
  const auto rows = static_cast<Eigen::Index>(6 * nodes.size());
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(rows, static_cast<Eigen::Index>(groups.size()),
                                                  std::numeric_limits<double>::infinity());
  GroupEquations equations(graph, poses, roles, groups, nodes);
  if (!equations.is_determined) return out;
  // The columns of H^-1 at the nodes serve all groups, as H^-1 is symmetric.
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(6 * equations.structure.variables, rows);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto node = std::ranges::lower_bound(equations.reduced.nodes, nodes[k]) - equations.reduced.nodes.begin();
    const int v = equations.structure.variable[static_cast<std::size_t>(node)];
    if (v >= 0) columns.block<6, 6>(6 * v, static_cast<Eigen::Index>(6 * k)).setIdentity();
  }
  equations.equations->hessian().solve(columns);
  const SelectedInverse inverse(equations.equations->hessian().take_factor());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Group group = equations.whitened(groups[g]);
    const Eigen::LDLT<Eigen::MatrixXd> others = of_others(known_of(group, inverse));
    if (others.info() != Eigen::Success || !(others.vectorD().minCoeff() > kHardlyKnown)) continue;
    const Eigen::VectorXd w = others.solve(residual_of(group));
    auto moves = out.col(static_cast<Eigen::Index>(g));
    moves.setZero();
    for (std::size_t a = 0; a < group.size(); ++a) {
      const Vector6d own = w.segment<6>(static_cast<Eigen::Index>(6 * a));
      for (const auto& [v, J] :
           {std::pair(group[a].slot.from, &group[a].J_from), std::pair(group[a].slot.to, &group[a].J_to)})
        if (v >= 0) moves += columns.middleRows<6>(6 * v).transpose() * (J->transpose() * own);
    }
  }
  return out;
}

}  // namespace tutti::estimation
