// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"

namespace tutti::estimation::internal {

/// Neighbouring columns of the Cholesky factor that are factorised as one dense panel. Numbers are of blocks.
struct Supernode {
  /// A supernode whose columns are among the rows below.
  struct Ancestor {
    int supernode = 0;
    std::size_t begin = 0, end = 0;  ///< Rows below that are its columns.
    std::vector<int> at;             ///< Per row below from `begin` on its position among the ancestor's rows.
  };
  int first = 0;
  int columns = 0;
  std::vector<int> below;  ///< Rows beneath the columns, increasing.
  std::vector<Ancestor> ancestors;
  [[nodiscard]] int rows() const { return columns + static_cast<int>(below.size()); }
  [[nodiscard]] int end() const { return first + columns; }
  /// Among the columns, then the rows below; `row` must be one of them.
  [[nodiscard]] int position_of(int row) const;
  /// The row at this position, below rows().
  [[nodiscard]] int row_at(int position) const {
    return position < columns ? first + position : below[static_cast<std::size_t>(position - columns)];
  }
};

/// The supernodes of the factor, in elimination order: columns of one structure (Liu, Ng, Peyton 1993), and neighbours
/// that are merged with their parent although it fills in zeros, because larger panels are faster (Ashcraft, Grimes
/// 1989): up to 6 columns (20) with at most 30 % (10 %) of zeros, more with 5 %. The order of `structure` must be
/// postordered.
std::vector<Supernode> find_supernodes(const BlockStructure& structure);

}  // namespace tutti::estimation::internal
