// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

/// Weighted undirected graphs as sparse symmetric matrices. Every function takes graphs of any size: no nodes, one
/// node, isolated nodes and disconnected graphs included. Source: Bernreiter et al., "Collaborative Robot Mapping using
/// Spectral Graph Analysis", ICRA 2022 ("the paper").
namespace tutti::spectral {

/// Square, symmetric, compressed, rows ascending inside each column.
using SparseMatrix = Eigen::SparseMatrix<double>;

struct WeightedEdge {
  int a = 0;
  int b = 0;
  double weight = 0.0;
};

/// Adjacency of the proximity graph, eq. (1): w(n, m) = exp(-||v_n - v_m|| / (2 sigma^2)) (the norm is not squared)
/// when the distance is at most `radius_m`, else no edge; zero diagonal. positions: one 3-vector per node, any frame,
/// metres, finite; radius_m > 0, sigma_m > 0. A weight that underflows to 0 is no edge. With `most_neighbours` > 0 an
/// edge stays only if it is among the `most_neighbours` shortest of at least one of its two nodes (of equally long
/// ones, to the neighbour of smaller number), so that a thousand nodes in one room do not make a million edges.
[[nodiscard]] SparseMatrix proximity_adjacency(std::span<const Eigen::Vector3d> positions, double radius_m,
                                               double sigma_m, int most_neighbours = 0);

/// Symmetric adjacency of a graph of `nodes` nodes. Every weight must be finite and positive and the two ends of an
/// edge must differ; the weights of several edges between the same two nodes add up.
[[nodiscard]] SparseMatrix adjacency_from_edges(int nodes, std::span<const WeightedEdge> edges);

/// L = D - A, eq. (2), D the diagonal matrix of A's row sums. Every diagonal entry is stored, also an isolated node's
/// 0.
[[nodiscard]] SparseMatrix laplacian(const SparseMatrix& adjacency);

struct Components {
  std::vector<int> label;  ///< Per node, 0 .. count - 1, numbered in order of each component's first node.
  int count = 0;
};

/// Connected components; `graph` is an adjacency or a Laplacian (only the pattern off the diagonal counts).
[[nodiscard]] Components connected_components(const SparseMatrix& graph);

}  // namespace tutti::spectral
