// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/spectrum.hpp"

#include <Spectra/SymEigsSolver.h>
#include <lapacke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "tutti/base/check.hpp"
#include "tutti/spectral/internal/row_blocks.hpp"

namespace tutti::spectral {
namespace {

using Eigen::Index;

void fix_sign(Eigen::Ref<Eigen::VectorXd> vector) {
  Index largest = 0;
  if (vector.size() > 0 && vector.cwiseAbs().maxCoeff(&largest) > 0.0 && vector[largest] < 0.0) vector = -vector;
}

/// Fixed numbers in [-1, 1) without any pattern, so that no eigenvector is orthogonal to them.
Eigen::VectorXd start_vector(Index size) {
  Eigen::VectorXd out(size);
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  for (Index n = 0; n < size; ++n) {  // 64-bit linear congruential generator [Knuth, MMIX]; its upper bits
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    out[n] = std::ldexp(static_cast<double>(state >> 11U), -52) - 1.0;
  }
  return out;
}

/// The two largest eigenvalues of a symmetric tridiagonal matrix, and how much of the first one's unit eigenvector sits
/// in the last entry.
struct TopRitz {
  double first, second, last_entry;
};

TopRitz top_of_tridiagonal(std::vector<double> diagonal, std::vector<double> off_diagonal) {
  const auto n = static_cast<lapack_int>(diagonal.size());
  lapack_int found = 0;
  std::array<double, 2> values{};
  std::vector<double> vectors(2 * diagonal.size());
  std::array<lapack_int, 4> support{};
  const lapack_int info = LAPACKE_dstevr(LAPACK_COL_MAJOR, 'V', 'I', n, diagonal.data(), off_diagonal.data(), 0.0, 0.0,
                                         n - 1, n, 0.0, &found, values.data(), vectors.data(), n, support.data());
  TUTTI_CHECK(info == 0 && found == 2, "dstevr: info {}, {} eigenvalues", info, found);
  return {.first = values[1], .second = values[0], .last_entry = std::abs(vectors.back())};
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
    matrix_.multiply_subtract(in_, out_);
    Eigen::Map<Eigen::VectorXd>(out, rows()) = out_;
  }

 private:
  const internal::RowBlocks& matrix_;
  mutable Eigen::VectorXd in_, out_;
};

}  // namespace

Spectrum dense_spectrum(const SparseMatrix& laplacian) {
  const auto n = static_cast<lapack_int>(laplacian.rows());
  Spectrum out{.eigenvalues = Eigen::VectorXd(n), .eigenvectors = Eigen::MatrixXd(laplacian)};
  if (n == 0) return out;
  const lapack_int info =
      LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', n, out.eigenvectors.data(), n, out.eigenvalues.data());  // eq. (4)
  TUTTI_CHECK(info == 0, "dsyevd: info {} (a Laplacian with NaN?)", info);
  out.eigenvalues = out.eigenvalues.cwiseMax(0.0);
  for (Index k = 0; k < n; ++k) fix_sign(out.eigenvectors.col(k));
  return out;
}

ExtremalPair largest_eigenpair(const SparseMatrix& laplacian, double tolerance) {
  constexpr Index kDenseUpTo = 64;
  const Index n = laplacian.rows();
  if (n == 0) return {.converged = true};
  if (largest_eigenvalue_bound(laplacian) == 0.0) return {.vector = Eigen::VectorXd::Unit(n, 0), .converged = true};
  if (n <= kDenseUpTo) {
    const Spectrum spectrum = dense_spectrum(laplacian);
    return {.value = spectrum.eigenvalues[n - 1], .vector = spectrum.eigenvectors.col(n - 1), .converged = true};
  }
  constexpr Index kKrylov = 40;
  constexpr Index kMaxRestarts = 1000;
  const internal::RowBlocks blocks(laplacian, 1.0, 0.0);
  Operator product(blocks);
  Spectra::SymEigsSolver<Operator> solver(product, 1, kKrylov);
  const Eigen::VectorXd start = blocks.to_blocks(start_vector(n));
  solver.init(start.data());
  solver.compute(Spectra::SortRule::LargestAlge, kMaxRestarts, tolerance);
  ExtremalPair out{.vector = Eigen::VectorXd::Zero(n), .iterations = static_cast<int>(solver.num_operations())};
  if (solver.info() != Spectra::CompInfo::Successful) return out;
  out.value = solver.eigenvalues()[0];
  blocks.from_blocks(solver.eigenvectors(1).col(0), out.vector);
  out.vector.normalize();
  fix_sign(out.vector);
  out.converged = (laplacian * out.vector - out.value * out.vector).norm() <= tolerance * out.value;
  return out;
}

/// Lanczos without reorthogonalisation: lost orthogonality brings copies of converged eigenvalues, it never moves the
/// largest one [Paige 1980].
double largest_eigenvalue(const SparseMatrix& laplacian, double tolerance) {
  constexpr std::size_t kFirstCheck = 16;
  const Index n = laplacian.rows();
  const double bound = largest_eigenvalue_bound(laplacian);
  if (bound == 0.0) return 0.0;
  const internal::RowBlocks blocks(laplacian, 1.0, 0.0);
  Eigen::VectorXd current = blocks.to_blocks(start_vector(n)).normalized();
  Eigen::VectorXd next = Eigen::VectorXd::Zero(current.size());  // beta times the previous vector, then the next one
  std::vector<double> alpha, beta;
  for (std::size_t check = kFirstCheck;;) {
    blocks.multiply_subtract(current, next);
    alpha.push_back(next.dot(current));
    next -= alpha.back() * current;
    const double length = next.norm();
    const bool exhausted = length <= 1e-14 * bound;  // the whole space has been seen
    if (exhausted && alpha.size() == 1) return alpha[0];
    if (exhausted || alpha.size() == check) {
      const TopRitz ritz = top_of_tridiagonal(alpha, beta);
      const double residual = length * ritz.last_entry;
      // The error is at most the residual, and of second order in it where the next eigenvalue is apart
      // [Parlett, 11.7].
      const double error = std::min(residual, residual * residual / (ritz.first - ritz.second));
      if (exhausted || error <= tolerance * ritz.first) return ritz.first;
      check += check / 4;
    }
    beta.push_back(length);
    next /= length;
    std::swap(current, next);
    next *= length;
  }
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
