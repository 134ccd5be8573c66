// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/lanczos.hpp"

#include <lapacke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/base/single_thread.hpp"

namespace tutti::spectral::internal {
namespace {

using Eigen::Index;

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
  const SingleThread single_thread;
  const lapack_int info = LAPACKE_dstevr(LAPACK_COL_MAJOR, 'V', 'I', n, diagonal.data(), off_diagonal.data(), 0.0, 0.0,
                                         n - 1, n, 0.0, &found, values.data(), vectors.data(), n, support.data());
  TUTTI_CHECK(info == 0 && found == 2, "dstevr: info {}, {} eigenvalues", info, found);
  return {.first = values[1], .second = values[0], .last_entry = std::abs(vectors.back())};
}

}  // namespace

/// Fixed numbers in [-1, 1) without any pattern.
Eigen::VectorXd start_vector(const RowBlocks& matrix) {
  Eigen::VectorXd out(matrix.nodes());
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  for (Index n = 0; n < matrix.nodes(); ++n) {  // 64-bit linear congruential generator [Knuth, MMIX]; its upper bits
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    out[n] = std::ldexp(static_cast<double>(state >> 11U), -52) - 1.0;
  }
  return matrix.to_blocks(out);
}

/// Lanczos without reorthogonalisation: lost orthogonality brings copies of converged eigenvalues, it never moves the
/// largest one [Paige 1980].
double largest_eigenvalue(const RowBlocks& matrix, double bound, double tolerance) {
  constexpr std::size_t kFirstCheck = 24;
  constexpr double kRounding = 1e-14;
  if (bound == 0.0) return 0.0;
  const auto max_steps = static_cast<std::size_t>(10 * matrix.nodes() + 100);
  Eigen::VectorXd current = start_vector(matrix).normalized();
  Eigen::VectorXd next = Eigen::VectorXd::Zero(current.size());  // comes in as beta times the previous vector
  std::vector<double> alpha, beta;
  for (std::size_t check = kFirstCheck;;) {
    matrix.step(1.0, 0.0, current, next);
    alpha.push_back(next.dot(current));
    next -= alpha.back() * current;
    const double length = next.norm();
    const bool last = length <= kRounding * bound || alpha.size() == max_steps;  // the whole space has been seen
    if (last && alpha.size() == 1) return alpha[0];
    if (last || alpha.size() == check) {
      const TopRitz ritz = top_of_tridiagonal(alpha, beta);
      const double residual = length * ritz.last_entry;
      // The error is at most the residual, and of second order in it when the next eigenvalue is apart [Parlett, 11.7].
      const double error = std::min(residual, residual * residual / (ritz.first - ritz.second));
      if (last || error <= tolerance * ritz.first) return ritz.first;
      check += check / 4;
    }
    beta.push_back(length);
    next /= length;
    std::swap(current, next);
    next *= length;
  }
}

}  // namespace tutti::spectral::internal
