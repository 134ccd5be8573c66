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

  /// Block column `column` of a factor of 6 x 6 blocks.
  class Column {
   public:
    using Block = Eigen::Map<const Matrix6d, 0, Eigen::OuterStride<>>;
    Column(const CholeskyFactor& factor, std::size_t column);
    /// Its lower triangle is L's.
    [[nodiscard]] Block diagonal() const { return at(first_); }
    /// How many blocks are below it, and which is in which block row; they increase.
    [[nodiscard]] int below() const { return node_.rows() - first_ - 1; }
    [[nodiscard]] std::size_t row(int below) const;
    [[nodiscard]] Block block(int below) const { return at(first_ + 1 + below); }
    /// The block column above this one in the elimination tree; none above the root.
    [[nodiscard]] std::optional<std::size_t> parent() const;

   private:
    [[nodiscard]] Block at(int position) const { return Block(begin_ + 6 * position, Eigen::OuterStride<>(stride_)); }
    const Supernode& node_;
    int first_;  // its position among the supernode's rows
    int stride_;
    const double* begin_;
  };
};

}  // namespace tutti::estimation::internal
