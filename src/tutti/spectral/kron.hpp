// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "tutti/spectral/graph.hpp"

/// Reduces a graph to some of its nodes so that it still behaves like the large one, and selects these nodes. Returned
/// lists of nodes are ascending.
namespace tutti::spectral {

struct KronReduction {
  SparseMatrix laplacian;  ///< Row i is node kept[i] of the original graph.
  std::vector<int> kept;   ///< Ascending, without repetitions.
};

/// Kron reduction: the Schur complement L_aa - L_ab L_bb^-1 L_ba, a = `keep` (any order, repetitions ignored), b = the
/// rest. Keeps effective resistances between kept nodes; the result is a valid Laplacian again. A component without any
/// kept node vanishes (its block of L_bb is singular, but nothing couples to it). Connected nodes stay connected; edges
/// below 1e-16 of their nodes' degrees may be left out. The result is much denser than the original; sparsify() thins
/// it.
[[nodiscard]] KronReduction kron_reduce(const SparseMatrix& laplacian, std::span<const int> keep);

/// Drops edge (a, b) when its weight is below relative_threshold * min(degree(a), degree(b)), unless it belongs to the
/// maximum-weight spanning forest: connected nodes stay connected. Degrees shrink by what was dropped, so the result is
/// a valid Laplacian.
[[nodiscard]] SparseMatrix sparsify(const SparseMatrix& laplacian, double relative_threshold);

/// The paper's selection, eq. (3): the nodes with u_max(n) >= 0, u_max the eigenvector of the largest eigenvalue with
/// its largest-magnitude entry positive; and `must_keep`. An entry of |u_max(n)| <= noise_tolerance counts as 0, so its
/// node is kept: u_max is localised, and on a long tunnel nearly all of its entries are rounding noise.
[[nodiscard]] std::vector<int> select_largest_eigenvector(const SparseMatrix& laplacian,
                                                          std::span<const int> must_keep = {},
                                                          double noise_tolerance = 1e-10);

/// Exactly min(n, max(budget, |must_keep|)) of the n nodes, `must_keep` among them, spread over the graph in proportion
/// to how dense it is: farthest-point sampling, distances weighed by degree. `positions`: one per node, m, the ones
/// that the graph was built from. The selection depends on the positions, not on the numbering of the nodes (but for
/// nodes at the very same place and rounding of the degrees). Time: O(nodes * budget).
[[nodiscard]] std::vector<int> select_budget(const SparseMatrix& laplacian, std::span<const Eigen::Vector3d> positions,
                                             int budget, std::span<const int> must_keep = {});

}  // namespace tutti::spectral
