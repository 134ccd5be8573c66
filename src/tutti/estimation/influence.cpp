// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/influence.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation {
namespace {

using internal::BlockStructure;
using internal::EdgeSlot;
using internal::SelectedInverse;

/// Less than this share of what is known of a direction comes from elsewhere: nothing does.
constexpr double kAlone = 1e-9;
/// Less than this share comes from elsewhere: where that would have its ends is not known at all.
constexpr double kUnknown = 1e-7;

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
  const Matrix6d upper = root_of_information(edge.information);
  return {slot, component, upper * factor.residual, upper * factor.J_i, upper * factor.J_j};
}

using Group = std::vector<Whitened>;

/// The force on its ends that has the effect of taking a group away.
struct Pull {
  std::size_t group = 0;
  double distance = 0.0;  ///< The length of what it moves of all poses, in the covariance of all.
  std::vector<int> ends;  ///< Variables.
  Eigen::VectorXd force;  ///< J^T (I - K)^-1 r; shift = H^-1 force
};

/// The effect of losing a group, to first order, seen from the ends of its edges: closures come by the product of the
/// keyframes that they join, so the ends are far fewer than the edges. With C = L L^T the rows and columns of H^-1 at
/// the ends, J and r the Jacobian and the residuals of all edges there, M = L^T J^T J L has the eigenvalues of K, and
/// by the push-through identity J^T (I - K)^-1 = L^-T (I - M)^-1 L^T J^T.
class GroupLoss {
 public:
  GroupLoss(const Group& group, const SelectedInverse& inverse) {
    std::map<int, int> component_of;  // of variables; anchored ends do not move
    for (const Whitened& edge : group)
      for (const int v : {edge.slot.from, edge.slot.to})
        if (v >= 0) component_of.emplace(v, edge.component);
    for (const auto& [v, component] : component_of) ends_.push_back(v);
    if (ends_.empty()) {  // of the fixed node alone
      least_known_ = 1.0;
      return;
    }
    const Eigen::Index size = 6 * static_cast<Eigen::Index>(ends_.size());
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(size, size), information = C;
    force_ = Eigen::VectorXd::Zero(size);
    Eigen::Index column = 0;
    for (const auto& [j, component_j] : component_of) {
      Eigen::Index row = 0;
      for (const auto& [i, component_i] : component_of) {  // nothing joins two components: no pattern has their block
        if (component_i == component_j) C.block<6, 6>(row, column) = inverse.block(i, j);
        row += 6;
      }
      column += 6;
    }
    for (const Whitened& edge : group) {
      for (const auto& [a, J_a] : ends_of(edge)) {
        force_.segment<6>(a) += J_a->transpose() * edge.residual;
        for (const auto& [b, J_b] : ends_of(edge)) information.block<6, 6>(a, b) += J_a->transpose() * *J_b;
      }
    }
    known_.compute(C);
    if (known_.info() != Eigen::Success) return;
    Eigen::MatrixXd others = -(known_.matrixU() * information * known_.matrixL().toDenseMatrix());
    others.diagonal().array() += 1.0 + kAlone;
    others_.compute(others);
    if (others_.info() == Eigen::Success) least_known_ = others_.matrixLLT().diagonal().array().square().minCoeff();
  }

  /// The least share of any direction that comes from elsewhere, to within what a factorisation tells; 0 where the loss
  /// is not known.
  [[nodiscard]] double least_known() const { return least_known_; }
  [[nodiscard]] Pull pull(std::size_t group) const {
    if (ends_.empty()) return {group, 0.0, {}, {}};
    const Eigen::VectorXd whitened = others_.solve(known_.matrixU() * force_);
    return {group, whitened.norm(), ends_, known_.matrixU().solve(whitened)};
  }
  /// The squared length of what the loss moves between the ends of one of its edges, in the covariance of the rest.
  [[nodiscard]] double misfit_at(const Whitened& edge) const {
    if (ends_.empty()) return 0.0;
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(force_.size(), 7);
    right.col(0) = force_;
    for (const auto& [a, J] : ends_of(edge)) right.block<6, 6>(a, 1) = J->transpose();
    right = known_.matrixU() * right;
    const Eigen::MatrixXd solved = others_.solve(right);
    const Vector6d moved = right.rightCols<6>().transpose() * solved.col(0);
    const Matrix6d covariance = right.rightCols<6>().transpose() * solved.rightCols<6>();
    return std::max(0.0, squared_distance(moved, 0.5 * (covariance + covariance.transpose())));
  }

 private:
  /// First rows of the ends that move, with the edge's Jacobian there.
  [[nodiscard]] std::vector<std::pair<Eigen::Index, const Matrix6d*>> ends_of(const Whitened& edge) const {
    std::vector<std::pair<Eigen::Index, const Matrix6d*>> out;
    for (const auto& [v, J] : {std::pair(edge.slot.from, &edge.J_from), std::pair(edge.slot.to, &edge.J_to)})
      if (v >= 0) out.emplace_back(6 * (std::ranges::lower_bound(ends_, v) - ends_.begin()), J);
    return out;
  }

  std::vector<int> ends_;
  Eigen::VectorXd force_;  // J^T r
  Eigen::LLT<Eigen::MatrixXd> known_, others_;
  double least_known_ = 0.0;
};

/// The normal equations at the optimum, factorised, of the graph without what only passes odometry on, and the groups
/// in it.
struct GroupEquations {
  GroupEquations(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                 std::span<const std::vector<std::size_t>> groups)
      : reduced(reduce_chains(graph, roles, {}, poses)) {
    for (const std::size_t node : reduced.nodes) at.push_back(poses[node]);
    std::vector<std::pair<std::size_t, std::size_t>> pairs;  // every end of a group with every other
    for (const auto& group : groups) {
      std::set<std::size_t> ends;
      for (const std::size_t e : group) ends.insert({edge(e).from, edge(e).to});
      for (const std::size_t a : ends)
        for (const std::size_t b : ends)
          if (a <= b) pairs.emplace_back(a, b);
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
  /// How the nodes of `graph`, all of them, at `poses`, move by each: 6 rows per node, a column per pull.
  Eigen::MatrixXd moves_by(std::span<const Pull> pulls, const PoseGraph& graph, std::span<const Pose3> poses) {
    const auto columns = static_cast<Eigen::Index>(pulls.size());
    Eigen::MatrixXd shifts = Eigen::MatrixXd::Zero(6 * structure.variables, columns);
    for (Eigen::Index c = 0; c < columns; ++c) {
      const Pull& pull = pulls[static_cast<std::size_t>(c)];
      for (std::size_t end = 0; end < pull.ends.size(); ++end)
        shifts.col(c).segment<6>(6 * pull.ends[end]) = pull.force.segment<6>(static_cast<Eigen::Index>(6 * end));
    }
    equations->hessian().solve(shifts);
    Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * reduced.nodes.size()), columns);
    for (std::size_t node = 0; node < reduced.nodes.size(); ++node)
      if (const int v = structure.variable[node]; v >= 0)
        moves.middleRows<6>(static_cast<Eigen::Index>(6 * node)) = shifts.middleRows<6>(6 * v);
    return expand_moves(graph, reduced, poses, moves);
  }

  ReducedGraph reduced;
  std::vector<Pose3> at;  // of reduced nodes
  BlockStructure structure;
  std::unique_ptr<internal::GraphEquations> equations;
  bool is_determined = false;
};

}  // namespace

std::vector<Influence> largest_influences(const PoseGraph& graph, std::span<const Pose3> poses,
                                          std::span<const EdgeRole> roles,
                                          std::span<const std::vector<std::size_t>> groups, std::size_t count,
                                          double least_distance) {
  TUTTI_CHECK(poses.size() == graph.poses.size(), "{} poses, {} nodes", poses.size(), graph.poses.size());
  if (groups.empty() || count == 0) return {};
  GroupEquations equations(graph, poses, roles, groups);
  if (!equations.is_determined) return {};
  std::vector<Pull> pulls;
  {  // the inverse is as large as the factor, and goes before the shifts come
    const SelectedInverse inverse(equations.equations->hessian().factor().copy());
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const GroupLoss loss(equations.whitened(groups[g]), inverse);
      if (!(loss.least_known() > kUnknown)) continue;
      if (Pull pull = loss.pull(g); pull.distance > least_distance) pulls.push_back(std::move(pull));
    }
  }
  if (pulls.empty()) return {};
  std::ranges::stable_sort(pulls, std::greater(), &Pull::distance);
  pulls.resize(std::min(count, pulls.size()));
  const Eigen::MatrixXd moves = equations.moves_by(pulls, graph, poses);
  std::vector<Influence> out;
  for (std::size_t k = 0; k < pulls.size(); ++k)
    out.push_back({pulls[k].group, pulls[k].distance, moves.col(static_cast<Eigen::Index>(k))});
  return out;
}

std::vector<double> group_misfits(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const EdgeRole> roles,
                                  std::span<const std::vector<std::size_t>> groups) {
  std::vector<double> out(groups.size(), 0.0);
  if (groups.empty()) return out;
  GroupEquations equations(graph, poses, roles, groups);
  if (!equations.is_determined) return out;
  const SelectedInverse inverse(equations.equations->hessian().take_factor());
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (const Group group = equations.whitened(groups[g]); !group.empty()) {
      const GroupLoss loss(group, inverse);
      if (loss.least_known() > 0.0) out[g] = loss.misfit_at(group[group.size() / 2]);
    }
  return out;
}

}  // namespace tutti::estimation
