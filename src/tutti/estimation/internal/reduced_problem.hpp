// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/chain_graph.hpp"
#include "tutti/estimation/internal/front_tree.hpp"
#include "tutti/estimation/internal/normal_equations.hpp"

namespace tutti::estimation::internal {

/// The reduced graph of a chain and its normal equations, kept from one update to the next. A factor is linearised
/// again only if its residual (that is, the relative pose of its ends: residual and Jacobians in body frames do not
/// show a common motion) or its weight changed since; only what lies above such a factor is computed again.
class ReducedProblem final : public NormalEquations {
 public:
  /// Takes over other constraints. True when the pattern changed.
  bool update(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
              std::span<const ChainConstraint> constraints, const Pose3& first);

  [[nodiscard]] const ChainGraph& reduced() const { return now_; }

  [[nodiscard]] const PoseGraph& graph() const override { return now_.graph; }
  [[nodiscard]] int components() const override { return 1; }
  [[nodiscard]] int variable(std::size_t node) const override { return static_cast<int>(node) - 1; }
  [[nodiscard]] double cost(std::span<const Pose3> poses, const EdgeCosts& costs) override;
  void linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) override;
  [[nodiscard]] const Eigen::VectorXd& gradient() const override { return gradient_; }
  [[nodiscard]] bool factorise() override;
  void solve(Eigen::VectorXd& b) override { tree_.solve(b); }

  /// A linear system of other factors on the same edges, one by one: start_linearisation, set_factor (residual and
  /// Jacobians, weighted information) for every edge, then factorise().
  void start_linearisation();
  void set_factor(std::size_t edge, const BetweenLinearisation& factor, const Matrix6d& information);

 private:
  /// An edge's part of the Hessian, and where it was linearised.
  struct Linearised {
    bool valid = false;
    Vector6d residual;
    double weight = 0.0;
    double flatter = 0.0;  ///< 1 - curvature of the loss.
    Matrix6d from_from, to_from, to_to;
  };

  void carry_edges(const Carried& carried);
  void linearise(std::size_t edge, const BetweenLinearisation& linear, const Matrix6d& information);
  void add_gradient(std::size_t edge, const Vector6d& force);
  void assemble(int variable, FrontTree::Column& column);

  ChainGraph now_;
  ChainGraph before_;
  std::vector<Linearised> linearised_;
  std::vector<std::size_t> slot_;  ///< Per edge, among linearised_.
  FrontTree tree_;
  Eigen::VectorXd gradient_;
  /// Per edge, of the last cost(): relative pose of its ends, residual, information times that.
  std::vector<Pose3> relative_;
  std::vector<Vector6d> residual_;
  std::vector<Vector6d> force_;
};

}  // namespace tutti::estimation::internal
