// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation::internal {

/// Where the off-diagonal block of an edge lies in the lower triangle; `block` < 0: nowhere (an end is anchored).
struct EdgeSlot {
  int from = -1;             ///< Variable of the edge's `from`; -1 = anchored.
  int to = -1;               ///< Variable of the edge's `to`.
  int block = -1;            ///< Position among the blocks.
  bool row_is_from = false;  ///< The block's row is `from`, its column `to`; else the other way round.
};

/// Sparsity of the normal equations of a pose graph, in blocks, in elimination order. Fixed nodes, and the first node
/// of every connected component without any, are anchored and are no variables. Lower triangle by columns; each column
/// starts with its diagonal block.
struct BlockStructure {
  int components = 0;
  std::vector<int> component;  ///< Per node.
  std::vector<int> variable;   ///< Per node: position in elimination order, -1 = anchored.
  int variables = 0;
  std::vector<int> column_start;  ///< variables + 1, into block_row.
  std::vector<int> block_row;     ///< Row variable of each block, increasing within a column.
  std::vector<EdgeSlot> edges;    ///< Per edge.
};

/// `extra` pairs of nodes get a (structurally zero) block too; pairs across components are ignored.
BlockStructure analyse_blocks(const PoseGraph& graph, std::span<const std::pair<std::size_t, std::size_t>> extra = {},
                              std::span<const std::size_t> fixed = {});

/// Everything finite and every rotation a unit quaternion within 1e-3.
bool is_finite(const PoseGraph& graph);

}  // namespace tutti::estimation::internal
