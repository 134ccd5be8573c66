// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/estimation/internal/supernodes.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {

/// The factor L of a sparse matrix L L^T of blocks (no permutation), by supernodes: each is a dense panel of its
/// columns, whose upper triangle means nothing. Cheap to move.
struct CholeskyFactor {
  /// Where a supernode's panel is in `values`, column by column. Sizes are of numbers, not of blocks.
  struct Panel {
    std::ptrdiff_t begin = 0;
    int rows = 0, columns = 0;
    [[nodiscard]] int below() const { return rows - columns; }
  };

  /// Where what is; the same for all factors of a pattern.
  struct Layout {
    int block_size = 6;
    std::vector<Supernode> supernodes;
    std::vector<Panel> panels;      ///< Per supernode.
    std::vector<int> supernode_of;  ///< Per block column.
    std::ptrdiff_t size = 0;        ///< All panels together.
    Layout(std::vector<Supernode> nodes, int block_size);
  };

  std::shared_ptr<const Layout> layout;
  std::unique_ptr<double[]> values;  ///< Null: none.

  [[nodiscard]] CholeskyFactor copy() const;
  /// True when it has values.
  explicit operator bool() const { return values != nullptr; }
  [[nodiscard]] std::size_t block_columns() const { return layout->supernode_of.size(); }
  /// The panel of a supernode, from its first column on.
  [[nodiscard]] double* panel(std::size_t supernode) { return values.get() + layout->panels[supernode].begin; }
  [[nodiscard]] const double* panel(std::size_t supernode) const {
    return values.get() + layout->panels[supernode].begin;
  }

  /// The part of solving by a supernode J with the rows I below it. b_J and b_I: as many rows as J has columns and rows
  /// below. b_J <- L_JJ^-1 b_J, or L_JJ^-T b_J.
  void solve_within(std::size_t supernode, bool is_transposed, Eigen::Ref<Eigen::MatrixXd> b_J) const;
  /// L_IJ b_J
  [[nodiscard]] Eigen::MatrixXd times_below(std::size_t supernode, const Eigen::Ref<const Eigen::MatrixXd>& b_J) const;
  /// b_J <- b_J - L_IJ^T b_I
  void subtract_below(std::size_t supernode, const Eigen::MatrixXd& b_I, Eigen::Ref<Eigen::MatrixXd> b_J) const;

  /// The block at these positions among the supernode's rows and columns, in a factor of 6 x 6 blocks.
  using Block = Eigen::Map<const Matrix6d, 0, Eigen::OuterStride<>>;
  [[nodiscard]] Block block(std::size_t supernode, int row, int column) const;

  /// Block column `column` of a factor of 6 x 6 blocks.
  class Column {
   public:
    Column(const CholeskyFactor& factor, std::size_t column);
    /// Its lower triangle is L's.
    [[nodiscard]] Block diagonal() const { return factor_.block(supernode_, column_, column_); }
    /// How many blocks are below it, and which is in which block row; they increase.
    [[nodiscard]] int below() const { return node_.rows() - column_ - 1; }
    [[nodiscard]] std::size_t row(int below) const {
      return static_cast<std::size_t>(node_.row_at(column_ + 1 + below));
    }
    [[nodiscard]] Block block(int below) const { return factor_.block(supernode_, column_ + 1 + below, column_); }
    /// The block column above this one in the elimination tree; none above the root.
    [[nodiscard]] std::optional<std::size_t> parent() const;

   private:
    const CholeskyFactor& factor_;
    std::size_t supernode_;
    const Supernode& node_;
    int column_;  // its position in the supernode
  };
};

}  // namespace tutti::estimation::internal
