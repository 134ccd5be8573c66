// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"

namespace tutti::estimation::internal {

/// Sparse symmetric positive definite matrix of B x B blocks with its Cholesky factor (CHOLMOD). The pattern is
/// analysed once; values are written straight into their final place and refactorised in place.
class BlockCholesky {
 public:
  /// `structure` must outlive this.
  BlockCholesky(const BlockStructure& structure, int block_size);
  ~BlockCholesky();
  BlockCholesky(const BlockCholesky&) = delete;
  BlockCholesky& operator=(const BlockCholesky&) = delete;

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
  void solve(Eigen::Ref<Eigen::MatrixXd> b);

  /// The factor L (L L^T = H, no permutation) by columns, rows sorted; empty on failure.
  struct Columns {
    std::vector<int> start, row;
    std::vector<double> value;
  };
  [[nodiscard]] Columns factor();

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

  [[nodiscard]] bool pivots_are_sound() const;

  struct Cholmod;
  const BlockStructure& structure_;
  int block_size_;
  std::vector<double> values_;
  std::unique_ptr<Cholmod> cholmod_;
};

}  // namespace tutti::estimation::internal
