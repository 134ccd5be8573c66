// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/block_cholesky.hpp"
#include "tutti/estimation/internal/block_structure.hpp"
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

/// How one minimisation follows another.
struct Continuation {
  /// Converged only when, beside the cost, no pose has farther to go than this (m, rad), by the rate at which the steps
  /// shrink.
  double step_tolerance = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool limits_step() const { return step_tolerance < std::numeric_limits<double>::infinity(); }
};

/// Gauss-Newton over one graph, with the loss's own curvature as far as it is positive; the symbolic factorisation is
/// shared by all calls.
class GaussNewton {
 public:
  /// Both must outlive this.
  GaussNewton(const PoseGraph& graph, const BlockStructure& structure);

  /// Moves `poses` to a minimum. Uses of config: iterations, tolerance, halvings.
  SolveSummary minimise(std::vector<Pose3>& poses, const EdgeCosts& costs, const SolverConfig& config,
                        const Continuation& how = {});

  /// One linear system, factor by factor: start_linearisation, add_factor (position of its edge, residual and
  /// Jacobians, weighted information), solve_step (the minimiser, in elimination order; false = singular), step_of (of
  /// one node).
  void start_linearisation();
  void add_factor(std::size_t edge, const BetweenLinearisation& factor, const Matrix6d& information);
  [[nodiscard]] bool solve_step(Eigen::VectorXd& step);
  [[nodiscard]] Vector6d step_of(const Eigen::VectorXd& step, std::size_t node) const;

  [[nodiscard]] double cost(std::span<const Pose3> poses, const EdgeCosts& costs) const;
  /// Fills the Hessian J^T W J and, in elimination order, the gradient J^T W r.
  void linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian);
  [[nodiscard]] BlockCholesky& hessian() { return hessian_; }
  [[nodiscard]] const PoseGraph& graph() const { return graph_; }

 private:
  struct Tried {
    double scale;
    double cost;
  };
  /// Halves the step until it costs at most `most`, or for the last time; `candidate`: the poses after it.
  Tried search_line(const std::vector<Pose3>& poses, const Eigen::VectorXd& step, const EdgeCosts& costs, double most,
                    int max_halvings, std::vector<Pose3>& candidate) const;
  void add_gradient(const EdgeSlot& slot, const BetweenLinearisation& factor, const Vector6d& weighted_residual);
  void add_hessian(const EdgeSlot& slot, const BetweenLinearisation& factor, const Matrix6d& information);

  const PoseGraph& graph_;
  const BlockStructure& structure_;
  BlockCholesky hessian_;
  Eigen::VectorXd gradient_;
};

}  // namespace tutti::estimation::internal
