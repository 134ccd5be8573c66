// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/spectrum.hpp"

#include <Spectra/SymEigsSolver.h>
#include <lapacke.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "tutti/base/check.hpp"
#include "tutti/base/single_thread.hpp"
#include "tutti/spectral/internal/row_blocks.hpp"

namespace tutti::spectral {
namespace {

using Eigen::Index;

void fix_sign(Eigen::Ref<Eigen::VectorXd> vector) {
  Index largest = 0;
  if (vector.size() > 0 && vector.cwiseAbs().maxCoeff(&largest) > 0.0 && vector[largest] < 0.0) vector = -vector;
}

/// Product as Spectra asks for it.
class Operator {
 public:
  using Scalar = double;
  explicit Operator(const internal::RowBlocks& matrix)
      : matrix_(matrix), in_(Eigen::VectorXd::Zero(matrix.size())), out_(matrix.size()) {}
  [[nodiscard]] Index rows() const { return matrix_.size(); }
  [[nodiscard]] Index cols() const { return matrix_.size(); }
  void perform_op(const double* in, double* out) const {
    in_ = Eigen::Map<const Eigen::VectorXd>(in, rows());
    out_.setZero();
    matrix_.step(1.0, 0.0, in_, out_);
    Eigen::Map<Eigen::VectorXd>(out, rows()) = out_;
  }

 private:
  const internal::RowBlocks& matrix_;
  mutable Eigen::VectorXd in_, out_;
};

/// Fixed numbers in [-1, 1) without any pattern, so that no eigenvector is orthogonal to them; zero in the padding.
Eigen::VectorXd start_vector(const internal::RowBlocks& matrix) {
  Eigen::VectorXd out(matrix.nodes());
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  for (double& x : out) {  // 64-bit linear congruential generator [Knuth, MMIX]; its upper bits
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    x = std::ldexp(static_cast<double>(state >> 11U), -52) - 1.0;
  }
  return matrix.to_blocks(out);
}

}  // namespace

Spectrum dense_spectrum(const SparseMatrix& laplacian) {
  const auto n = static_cast<lapack_int>(laplacian.rows());
  Spectrum out{.eigenvalues = Eigen::VectorXd(n), .eigenvectors = Eigen::MatrixXd(laplacian)};
  if (n == 0) return out;
  const SingleThread single_thread;
  const lapack_int info =
      LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', n, out.eigenvectors.data(), n, out.eigenvalues.data());  // eq. (4)
  TUTTI_CHECK(info == 0, "dsyevd: info {} (a Laplacian with NaN?)", info);
  out.eigenvalues = out.eigenvalues.cwiseMax(0.0);
  for (Index k = 0; k < n; ++k) fix_sign(out.eigenvectors.col(k));
  return out;
}

namespace {

ExtremalPair dense_largest_eigenpair(const SparseMatrix& laplacian) {
  const Spectrum spectrum = dense_spectrum(laplacian);
  const Index last = laplacian.rows() - 1;
  return {.value = spectrum.eigenvalues[last], .vector = spectrum.eigenvectors.col(last), .converged = true};
}

}  // namespace

ExtremalPair largest_eigenpair(const SparseMatrix& laplacian, double tolerance) {
  constexpr Index kDenseUpTo = 64;
  const Index n = laplacian.rows();
  if (n == 0) return {.converged = true};
  if (largest_eigenvalue_bound(laplacian) == 0.0) return {.vector = Eigen::VectorXd::Unit(n, 0), .converged = true};
  if (n <= kDenseUpTo) return dense_largest_eigenpair(laplacian);
  constexpr Index kKrylov = 40;
  constexpr Index kMaxRestarts = 1000;
  const internal::RowBlocks blocks(laplacian);
  Operator product(blocks);
  Spectra::SymEigsSolver<Operator> solver(product, 1, kKrylov);
  ExtremalPair out{.vector = Eigen::VectorXd::Zero(n)};
  try {
    solver.init(start_vector(blocks).data());
    solver.compute(Spectra::SortRule::LargestAlge, kMaxRestarts, tolerance);
  } catch (const std::runtime_error&) {  // its own decomposition fails where it breaks down, see below
    return dense_largest_eigenpair(laplacian);
  }
  out.iterations = static_cast<int>(solver.num_operations());
  if (solver.info() == Spectra::CompInfo::Successful) {
    out.value = solver.eigenvalues()[0];
    blocks.from_blocks(solver.eigenvectors(1).col(0), out.vector);
    out.vector.normalize();
    fix_sign(out.vector);
    out.converged = (laplacian * out.vector - out.value * out.vector).norm() <= tolerance * out.value;
  }
  // Spectra 1.0 breaks down where a start vector contains fewer than kKrylov eigenvectors (the complete graph has two).
  return out.converged ? out : dense_largest_eigenpair(laplacian);
}

double largest_eigenvalue(const SparseMatrix& laplacian, double tolerance) {
  return largest_eigenpair(laplacian, tolerance).value;
}

double largest_eigenvalue_bound(const SparseMatrix& laplacian) {
  const Eigen::VectorXd degree = laplacian.diagonal();
  double bound = 0.0;
  for (Index n = 0; n < laplacian.cols(); ++n) {
    for (SparseMatrix::InnerIterator it(laplacian, n); it; ++it)
      if (it.row() != n && it.value() != 0.0) bound = std::max(bound, degree[n] + degree[it.row()]);
  }
  return bound;
}

}  // namespace tutti::spectral
