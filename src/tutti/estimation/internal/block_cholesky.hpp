// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/internal/cholesky_factor.hpp"

namespace tutti::estimation::internal {

/// Sparse symmetric positive definite matrix of B x B blocks, B = 3 or 6, with its Cholesky factor. The pattern is
/// analysed once; values are written straight into their final place and refactorised in place. Right-looking over
/// supernodes (Rothberg, Gupta 1993), with BLAS on one thread.
class BlockCholesky {
 public:
  static constexpr std::size_t kWorkspace = 1U << 18U;  ///< 2 MB
  /// `structure` must outlive this. `workspace`: so many numbers are kept for what a supernode takes from others, or as
  /// many as one of these needs.
  BlockCholesky(const BlockStructure& structure, int block_size, std::size_t workspace = kWorkspace);

  void set_zero();
  /// Adds to the diagonal block of a variable. Only its lower triangle is read by the factorisation.
  template <class Block>
  void add_diagonal(int variable, const Block& block) {
    this->block<Block::RowsAtCompileTime>(structure_.column_start[variable], variable) += block;
  }
  /// Adds H_from_to of an edge; does nothing when one end is anchored.
  template <class Block>
  void add_edge(const EdgeSlot& slot, const Block& H_from_to) {
    if (slot.block < 0) return;
    if (slot.row_is_from)
      this->block<Block::RowsAtCompileTime>(slot.block, slot.to) += H_from_to;
    else
      this->block<Block::RowsAtCompileTime>(slot.block, slot.from) += H_from_to.transpose();
  }

  /// False when the matrix is not numerically positive definite: a pivot lost all digits against its diagonal entry.
  [[nodiscard]] bool factorise();
  /// Overwrites b (rows: block_size x variables in elimination order) by H^-1 b. After a successful factorise() only.
  void solve(Eigen::Ref<Eigen::MatrixXd> b) const;

  /// The factor, L L^T = H. After a successful factorise() only.
  [[nodiscard]] const CholeskyFactor& factor() const;
  /// The same for keeps: nothing can be solved until it is factorised again.
  [[nodiscard]] CholeskyFactor take_factor();

 private:
  /// Columns of a block column are stored as one dense panel, blocks below each other, the diagonal block first.
  template <int B>
  auto block(int position, int column) {
    const int start = structure_.column_start[column];
    const int stride = B * (structure_.column_start[column + 1] - start);
    return Eigen::Map<Eigen::Matrix<double, B, B>, 0, Eigen::OuterStride<>>(
        values_.data() + static_cast<std::ptrdiff_t>(B) * B * start +
            static_cast<std::ptrdiff_t>(B) * (position - start),
        Eigen::OuterStride<>(stride));
  }

  template <int B>
  [[nodiscard]] bool factorise_blocks();
  template <int B>
  void add_matrix(std::size_t supernode);
  /// Ancestors of a supernode that are updated together.
  struct Group {
    std::size_t first = 0, end = 0;     ///< Positions in Supernode::ancestors.
    std::size_t row = 0;                ///< The first row below that is theirs.
    std::size_t columns = 0, rows = 0;  ///< The rows below that are theirs, and all from the first on, in blocks.
  };
  [[nodiscard]] Group group_from(const Supernode& node, std::size_t first) const;
  template <int B>
  void update_ancestors(std::size_t supernode);
  template <int B>
  void update(const Supernode& node, const Group& group);
  [[nodiscard]] bool pivots_are_sound(std::size_t supernode) const;

  using Panel = CholeskyFactor::Panel;
  [[nodiscard]] const std::vector<Supernode>& supernodes() const { return factor_.layout->supernodes; }
  [[nodiscard]] const std::vector<Panel>& panels() const { return factor_.layout->panels; }
  [[nodiscard]] int block_size() const { return factor_.layout->block_size; }
  const BlockStructure& structure_;
  std::vector<double> values_;
  CholeskyFactor factor_;      ///< Without values before factorise().
  std::vector<int> position_;  ///< Per block of the matrix its row in its supernode, in blocks.
  std::size_t workspace_;
  std::vector<double> update_;  ///< A supernode's update of a group: rows by columns.
  bool is_factorised_ = false;
};

}  // namespace tutti::estimation::internal
