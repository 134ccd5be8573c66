// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/wavelet_transform.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/spectral/internal/lanczos.hpp"
#include "tutti/spectral/internal/row_blocks.hpp"

namespace tutti::spectral {
namespace {

using Eigen::Index;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Chebyshev coefficients c_0 .. c_{N-1} on [0, domain] of every scale's *reduced* kernel
///   h_s(x) = (g_s(x) - g_s(0)) / x,  so that  g_s(L) f = g_s(0) f + h_s(L) (L f).
/// Meyer kernels are constant near 0, so h_s is as smooth as g_s; but L f is small where f is smooth, and zero for a
/// constant per component. On a tunnel this halves the order and passes constants exactly.
struct Expansion {
  RowMajor coefficient;  ///< N x scales; c_0 is already halved.
  RowMajor tail;         ///< N x scales; entry (k, s) bounds sup |h_s - its polynomial of degree k|.
};

/// On n points theta_q = pi (q + 1/2) / n: values to Chebyshev coefficients, c_k = 2/n sum_q value_q cos(k theta_q), by
/// one FFT [Makhoul 1980].
class CosineTransform {
 public:
  explicit CosineTransform(Index n) : folded_(n), turn_(n) {
    for (Index k = 0; k < n; ++k)
      turn_[k] = std::polar(2.0 / static_cast<double>(n),
                            -std::numbers::pi * static_cast<double>(k) / (2.0 * static_cast<double>(n)));
  }
  [[nodiscard]] Eigen::VectorXd operator()(const Eigen::VectorXd& value) {
    const Index n = value.size();
    for (Index q = 0; q < n / 2; ++q) {
      folded_[q] = value[2 * q];
      folded_[n - 1 - q] = value[2 * q + 1];
    }
    fft_.fwd(transformed_, folded_);
    return (turn_.array() * transformed_.array()).real();
  }

 private:
  Eigen::FFT<double> fft_;
  Eigen::VectorXd folded_;
  Eigen::VectorXcd turn_, transformed_;
};

/// n a power of two. The kernels have three continuous derivatives, so coefficients fall like k^-5 and all those from n
/// on sum up to about a fifteenth of those in [n/2, n): the latter bound what n leaves out and what it aliases.
Expansion expand(const MeyerFilterBank& bank, double domain, Index n) {
  Expansion out{.coefficient = RowMajor(n, bank.scales()), .tail = RowMajor(n, bank.scales())};
  CosineTransform transform(n);
  const Eigen::VectorXd angle =
      (Eigen::VectorXd::LinSpaced(n, 0.5, static_cast<double>(n) - 0.5)) * (std::numbers::pi / static_cast<double>(n));
  const Eigen::VectorXd x = 0.5 * domain * (1.0 + angle.array().cos());
  Eigen::VectorXd value(n);
  for (int s = 0; s < bank.scales(); ++s) {
    const double at_zero = bank.kernel(s, 0.0);
    for (Index q = 0; q < n; ++q) value[q] = (bank.kernel(s, x[q]) - at_zero) / x[q];
    Eigen::VectorXd c = transform(value);
    c[0] *= 0.5;
    out.coefficient.col(s) = c;
    double tail = c.tail(n / 2).cwiseAbs().sum();
    for (Index k = n - 1; k >= 0; --k) {
      out.tail(k, s) = tail;
      tail += std::abs(c[k]);
    }
  }
  return out;
}

/// Degree of each scale's polynomial. Larger scales never get less than smaller ones, so that the scales still running
/// at any degree are the first ones.
std::vector<Index> choose_degrees(const Expansion& expansion, double norm, double tolerance) {
  std::vector<Index> degrees(static_cast<std::size_t>(expansion.tail.cols()));
  Index least = 0;
  for (Index s = expansion.tail.cols() - 1; s >= 0; --s) {
    while (least + 1 < expansion.tail.rows() && expansion.tail(least, s) * norm > tolerance) ++least;
    degrees[static_cast<std::size_t>(s)] = least;
  }
  return degrees;
}

/// Column s = h_s(L) y by the recurrence T_{k+1} = 2 X T_k - T_{k-1} with X = (2 / domain) L - I.
Eigen::MatrixXd run_recurrence(const internal::RowBlocks& laplacian, double domain, const Expansion& expansion,
                               std::span<const Index> degrees, const Eigen::VectorXd& y) {
  Eigen::MatrixXd sums = y * expansion.coefficient.row(0);
  if (degrees.front() == 0) return sums;
  Eigen::VectorXd current = y;
  Eigen::VectorXd next = Eigen::VectorXd::Zero(y.size());
  laplacian.step(2.0 / domain, -1.0, current, next);  // T_1 y = X y
  sums += next * expansion.coefficient.row(1);
  auto active = degrees.size();
  for (Index k = 2; k <= degrees.front(); ++k) {
    std::swap(current, next);
    while (degrees[active - 1] < k) --active;
    laplacian.step(4.0 / domain, -2.0, current, next, std::span(&expansion.coefficient(k, 0), active), sums);
  }
  return sums;
}

}  // namespace

Eigen::MatrixXd exact_transform(const Spectrum& spectrum, const MeyerFilterBank& bank, const Eigen::MatrixXd& signals) {
  const Index nodes = spectrum.eigenvalues.size();
  TUTTI_CHECK(signals.rows() == nodes, "signals of {} nodes, graph of {}", signals.rows(), nodes);
  const Eigen::MatrixXd frequencies = spectrum.eigenvectors.transpose() * signals;  // eq. (5)
  Eigen::MatrixXd filtered(nodes, bank.scales() * signals.cols());
  for (int s = 0; s < bank.scales(); ++s) {
    const Eigen::VectorXd gain = spectrum.eigenvalues.unaryExpr([&](double x) { return bank.kernel(s, x); });
    filtered.middleCols(s * signals.cols(), signals.cols()) = gain.asDiagonal() * frequencies;
  }
  return spectrum.eigenvectors * filtered;  // eq. (7), applied to all signals
}

ChebyshevResult chebyshev_transform(const SparseMatrix& laplacian, const MeyerFilterBank& bank,
                                    const Eigen::MatrixXd& signals, const ChebyshevConfig& config) {
  TUTTI_CHECK(signals.rows() == laplacian.rows(), "signals of {} nodes, graph of {}", signals.rows(), laplacian.rows());
  TUTTI_CHECK(config.tolerance > 0.0 && config.max_order >= 1, "tolerance {}, max_order {}", config.tolerance,
              config.max_order);
  ChebyshevResult result;
  result.coefficients.setZero(signals.rows(), bank.scales() * signals.cols());
  for (int s = 0; s < bank.scales(); ++s)
    result.coefficients.middleCols(s * signals.cols(), signals.cols()) = bank.kernel(s, 0.0) * signals;

  const Eigen::MatrixXd smoothed = laplacian * signals;
  const double norm = smoothed.size() == 0 ? 0.0 : smoothed.colwise().norm().maxCoeff();
  if (norm == 0.0) return result;  // constant on every component

  // A hair more than the largest eigenvalue, because T_k grows exponentially outside of the domain.
  constexpr double kAccuracy = 1e-9;
  constexpr double kMargin = 1.0 + 1e-8;
  const internal::RowBlocks blocks(laplacian);
  const double bound = largest_eigenvalue_bound(laplacian);
  const double domain = std::min(bound, kMargin * internal::largest_eigenvalue(blocks, bound, kAccuracy));
  const Index max_degree = config.max_order - 1;  // one product made L f
  Index size = 2048;
  Expansion expansion = expand(bank, domain, size);
  while (choose_degrees(expansion, norm, config.tolerance).front() >= size / 2 && size / 2 <= max_degree)
    expansion = expand(bank, domain, size *= 2);

  for (Index c = 0; c < signals.cols(); ++c) {
    const double column_norm = smoothed.col(c).norm();
    auto degrees = choose_degrees(expansion, column_norm, config.tolerance);
    for (auto& degree : degrees) degree = std::min(degree, max_degree);
    const Eigen::MatrixXd sums = run_recurrence(blocks, domain, expansion, degrees, blocks.to_blocks(smoothed.col(c)));
    Eigen::VectorXd column(signals.rows());
    for (int s = 0; s < bank.scales(); ++s) {
      blocks.from_blocks(sums.col(s), column);
      result.coefficients.col(s * signals.cols() + c) += column;
      const double error = expansion.tail(degrees[static_cast<std::size_t>(s)], s) * column_norm;
      result.error_bound = std::max(result.error_bound, error);
    }
    result.order = std::max(result.order, static_cast<int>(degrees.front()) + 1);
  }
  result.converged = result.error_bound <= config.tolerance;
  return result;
}

}  // namespace tutti::spectral
