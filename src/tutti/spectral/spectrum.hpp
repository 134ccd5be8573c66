// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/spectral/graph.hpp"

/// Eigenvalues (graph frequencies) and eigenvectors (Fourier modes) of Laplacians. The sign of every eigenvector is
/// fixed: its entry of largest magnitude (the first of equals) is positive.
namespace tutti::spectral {

/// L = U diag(eigenvalues) U^T, eq. (4).
struct Spectrum {
  Eigen::VectorXd eigenvalues;   ///< n, ascending, >= 0 (rounding below zero is cut off).
  Eigen::MatrixXd eigenvectors;  ///< n x n, orthonormal columns.
};

/// All eigenpairs by LAPACK's dsyevd. O(n^3) time, O(n^2) memory: for reference and for small graphs.
[[nodiscard]] Spectrum dense_spectrum(const SparseMatrix& laplacian);

struct ExtremalPair {
  double value = 0.0;
  Eigen::VectorXd vector;  ///< Unit norm; empty for a graph without nodes.
  bool converged = false;
  int iterations = 0;  ///< Matrix-vector products; 0 when a dense solver did it.
};

/// The largest eigenvalue and its eigenvector, by Spectra; by LAPACK up to 64 nodes, and for larger graphs, in O(n^3),
/// where Spectra does not converge. Converged means ||L u - value u|| <= tolerance * value. Deterministic: the start
/// vector depends on the number of nodes only. For a graph without edges the value is 0 and the vector is the first
/// unit vector.
[[nodiscard]] ExtremalPair largest_eigenpair(const SparseMatrix& laplacian, double tolerance = 1e-10);

/// The value of largest_eigenpair(), with a relative error of at most `tolerance`. To compare two graphs, build one
/// MeyerFilterBank for both, with the larger of their two largest eigenvalues as lambda_max.
[[nodiscard]] double largest_eigenvalue(const SparseMatrix& laplacian, double tolerance = 1e-10);

/// Guaranteed upper bound on the largest eigenvalue in one pass over the edges, at most twice too large: max over edges
/// of degree(a) + degree(b) [Anderson, Morley 1985]. Use: an interval that must cover the spectrum.
[[nodiscard]] double largest_eigenvalue_bound(const SparseMatrix& laplacian);

}  // namespace tutti::spectral
