// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/influence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>

#include "tutti/base/check.hpp"
#include "tutti/estimation/between_factor.hpp"
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

}  // namespace

std::vector<Influence> largest_influences(const PoseGraph& graph, std::span<const Pose3> poses,
                                          std::span<const std::size_t> candidates, std::size_t count,
                                          double least_distance) {
  TUTTI_CHECK(poses.size() == graph.poses.size(), "{} poses, {} nodes", poses.size(), graph.poses.size());
  const BlockStructure structure = internal::analyse_blocks(graph);
  internal::GraphEquations equations(graph, structure);
  equations.linearise(poses, {}, true);
  if (candidates.empty() || count == 0 || structure.variables == 0 || !equations.hessian().factorise()) return {};
  std::vector<Pull> pulls;
  const SelectedInverse inverse(equations.hessian().factor());
  for (const std::size_t e : candidates) {
    TUTTI_CHECK(e < graph.edges.size(), "edge {} of {}", e, graph.edges.size());
    Pull pull = pull_of(e, graph.edges[e], poses, covariance_of_ends(inverse, structure.edges[e]));
    if (pull.distance > least_distance) pulls.push_back(std::move(pull));
  }
  if (pulls.empty()) return {};
  std::ranges::stable_sort(pulls, std::greater(), &Pull::distance);
  pulls.resize(std::min(count, pulls.size()));

  Eigen::MatrixXd shifts = Eigen::MatrixXd::Zero(6 * structure.variables, static_cast<Eigen::Index>(pulls.size()));
  for (std::size_t k = 0; k < pulls.size(); ++k) {
    const EdgeSlot& slot = structure.edges[pulls[k].edge];
    auto column = shifts.col(static_cast<Eigen::Index>(k));
    if (slot.from >= 0) column.segment<6>(6 * slot.from) = pulls[k].force.head<6>();
    if (slot.to >= 0) column.segment<6>(6 * slot.to) = pulls[k].force.tail<6>();
  }
  equations.hessian().solve(shifts);

  std::vector<Influence> out;
  for (std::size_t k = 0; k < pulls.size(); ++k) {
    Influence influence{pulls[k].edge, pulls[k].distance,
                        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * poses.size()))};
    for (std::size_t node = 0; node < poses.size(); ++node)
      if (const int v = structure.variable[node]; v >= 0)
        influence.shift.segment<6>(static_cast<Eigen::Index>(6 * node)) =
            shifts.col(static_cast<Eigen::Index>(k)).segment<6>(6 * v);
    out.push_back(std::move(influence));
  }
  return out;
}

}  // namespace tutti::estimation
