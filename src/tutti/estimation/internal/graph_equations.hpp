// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/internal/block_cholesky.hpp"
#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/internal/normal_equations.hpp"

namespace tutti::estimation::internal {

/// Normal equations of any graph, on CHOLMOD; the symbolic factorisation is shared by all calls.
class GraphEquations final : public NormalEquations {
 public:
  /// Both must outlive this.
  GraphEquations(const PoseGraph& graph, const BlockStructure& structure);

  [[nodiscard]] const PoseGraph& graph() const override { return graph_; }
  [[nodiscard]] int components() const override { return structure_.components; }
  [[nodiscard]] int variable(std::size_t node) const override { return structure_.variable[node]; }
  [[nodiscard]] double cost(std::span<const Pose3> poses, const EdgeCosts& costs) override;
  void linearise(std::span<const Pose3> poses, const EdgeCosts& costs, bool with_hessian) override;
  [[nodiscard]] const Eigen::VectorXd& gradient() const override { return gradient_; }
  [[nodiscard]] bool factorise() override { return hessian_.factorise(); }
  void solve(Eigen::VectorXd& b) override { hessian_.solve(b); }

  [[nodiscard]] BlockCholesky& hessian() { return hessian_; }

 private:
  void add_hessian(const EdgeSlot& slot, const BetweenLinearisation& factor, const Matrix6d& information);

  const PoseGraph& graph_;
  const BlockStructure& structure_;
  BlockCholesky hessian_;
  Eigen::VectorXd gradient_;
};

}  // namespace tutti::estimation::internal
