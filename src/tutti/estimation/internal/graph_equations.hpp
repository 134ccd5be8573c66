// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/block_cholesky.hpp"
#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/estimation/robust_loss.hpp"

namespace tutti::estimation::internal {

/// The cost of an edge: scale[e] * rho(r^T Omega r), rho only where the role is robust.
struct EdgeCosts {
  RobustLoss loss;
  std::span<const EdgeRole> roles;  ///< Empty: all robust.
  std::span<const double> scale;    ///< Empty: all 1.

  [[nodiscard]] bool is_robust(std::size_t e) const {
    return loss.kind != LossKind::none && (roles.empty() || roles[e] == EdgeRole::robust);
  }
  [[nodiscard]] double scale_of(std::size_t e) const { return scale.empty() ? 1.0 : scale[e]; }
  [[nodiscard]] double cost(std::size_t e, double s) const { return scale_of(e) * (is_robust(e) ? loss.rho(s) : s); }
  [[nodiscard]] double weight(std::size_t e, double s) const {
    return scale_of(e) * (is_robust(e) ? loss.weight(s) : 1.0);
  }
  [[nodiscard]] double curvature(std::size_t e, double s) const { return is_robust(e) ? loss.curvature(s) : 1.0; }
};

/// Gauss-Newton's linear system over a pose graph, with the loss's own curvature as far as it is positive. The pattern
/// is analysed once for all calls.
class GraphEquations {
 public:
  /// Both must outlive this; measurements and information of `graph` may change between calls.
  GraphEquations(const PoseGraph& graph, const BlockStructure& structure);

  [[nodiscard]] const PoseGraph& graph() const { return graph_; }
  [[nodiscard]] int components() const { return structure_.components; }
  [[nodiscard]] int variable(std::size_t node) const { return structure_.variable[node]; }
  [[nodiscard]] double cost(std::span<const Pose3> poses, const EdgeCosts& costs);
  void linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian);
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] bool factorise() { return hessian_.factorise(); }
  void solve(Eigen::VectorXd& b) { hessian_.solve(b); }

  [[nodiscard]] BlockCholesky& hessian() { return hessian_; }

 private:
  void add_hessian(const EdgeSlot& slot, const BetweenLinearisation& factor, const Matrix6d& information);

  const PoseGraph& graph_;
  const BlockStructure& structure_;
  BlockCholesky hessian_;
  Eigen::VectorXd gradient_;
};

}  // namespace tutti::estimation::internal
