// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/estimation/robust_loss.hpp"

namespace tutti::estimation::internal {

/// What an edge costs: scale[e] * rho(r^T Omega r), rho only where the role is robust.
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

/// Gauss-Newton's linear system over a pose graph, with the loss's own curvature as far as it is positive.
class NormalEquations {
 public:
  virtual ~NormalEquations() = default;

  [[nodiscard]] virtual const PoseGraph& graph() const = 0;
  [[nodiscard]] virtual int components() const = 0;
  /// Position of a node's six unknowns among all; -1 = anchored.
  [[nodiscard]] virtual int variable(std::size_t node) const = 0;
  [[nodiscard]] virtual double cost(std::span<const Pose3> poses, const EdgeCosts& costs) = 0;
  /// Makes the gradient J^T W r and, where asked for, the Hessian J^T W J. `poses`: those of the last cost().
  virtual void linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) = 0;
  [[nodiscard]] virtual const Eigen::VectorXd& gradient() const = 0;
  /// False when the Hessian is singular.
  [[nodiscard]] virtual bool factorise() = 0;
  /// Overwrites b by H^-1 b, H of the last factorise().
  virtual void solve(Eigen::VectorXd& b) = 0;
};

}  // namespace tutti::estimation::internal
