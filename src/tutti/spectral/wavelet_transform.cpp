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
/// on sum up to less than half of those in [3n/4, n): the latter bound what n leaves out and what it aliases.
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
    double tail = c.tail(n / 4).cwiseAbs().sum();
    for (Index k = n - 1; k >= 0; --k) {
      out.tail(k, s) = tail;
      tail += std::abs(c[k]);
    }
  }
  return out;
}

/// Smallest degree of each scale's polynomial whose worst case meets the tolerance.
std::vector<Index> worst_case_degrees(const Expansion& expansion, double norm, double tolerance) {
  std::vector<Index> degrees;
  for (Index s = 0; s < expansion.tail.cols(); ++s) {
    Index degree = 0;
    while (degree + 1 < expansion.tail.rows() && expansion.tail(degree, s) * norm > tolerance) ++degree;
    degrees.push_back(degree);
  }
  return degrees;
}

/// T_k(X) y for k = 0, 1, ..., with X = (2 / domain) L - I, its sums over k for every scale, and the moments
/// mu_m = y^T T_m(X) y, two for every product [T_j T_k = (T_{j+k} + T_|j-k|) / 2].
class Recurrence {
 public:
  Recurrence(const internal::RowBlocks& laplacian, double domain, const Expansion& expansion, const Eigen::VectorXd& y)
      : laplacian_(laplacian),
        domain_(domain),
        expansion_(expansion),
        current_(y),
        previous_(Eigen::VectorXd::Zero(y.size())),
        sums_(y * expansion.coefficient.row(0)),
        moments_{y.squaredNorm()} {}

  /// Goes on to the highest of the degrees; scale s gets no term above degrees[s]. Degrees must not grow with s.
  void run(std::span<const Index> degrees, bool with_moments) {
    for (auto active = degrees.size(); degree_ < degrees.front();) {
      ++degree_;
      while (degrees[active - 1] < degree_) --active;
      const double half = degree_ == 1 ? 0.5 : 1.0;  // T_1 = X T_0, then T_{k+1} = 2 X T_k - T_{k-1}
      const std::span weights(&expansion_.coefficient(degree_, 0), active);
      laplacian_.step(half * 4.0 / domain_, half * -2.0, current_, previous_, weights, sums_);
      std::swap(current_, previous_);
      if (!with_moments) continue;
      const double odd = current_.dot(previous_);
      moments_.push_back(degree_ == 1 ? odd : 2.0 * odd - moments_[1]);
      moments_.push_back(2.0 * current_.squaredNorm() - moments_[0]);
    }
  }
  [[nodiscard]] const Eigen::MatrixXd& sums() const { return sums_; }
  [[nodiscard]] std::span<const double> moments() const { return moments_; }

 private:
  const internal::RowBlocks& laplacian_;
  double domain_;
  const Expansion& expansion_;
  Index degree_ = 0;
  Eigen::VectorXd current_, previous_;
  Eigen::MatrixXd sums_;
  std::vector<double> moments_;
};

/// Entry K - from bounds || sum_{K < j <= to} c_j T_j(X) y ||_2 for K = from .. to, `to - from` <= number of moments:
/// with x = cos(theta) and mu the signal's spectral measure, the square is
///   int (sum c_j cos(j theta))^2 dmu <= int |sum c_j e^{i j theta}|^2 dmu = sum_{j, k} c_j c_k mu_|j-k|.
/// Unlike sum |c_j| ||y|| it knows that the signal has little energy where the polynomial is still wrong.
std::vector<double> measured_bounds(const Eigen::Ref<const Eigen::VectorXd>& c, std::span<const double> moments,
                                    Index from, Index to) {
  constexpr double kRounding = 1e-14;
  std::vector<double> out(static_cast<std::size_t>(to - from) + 1, 0.0);
  const auto mu = Eigen::VectorXd::Map(moments.data(), static_cast<Index>(moments.size()));
  double square = 0.0;
  double sum = 0.0;
  for (Index j = to; j > from; --j) {
    square += c[j] * (c[j] * mu[0] + 2.0 * c.segment(j + 1, to - j).dot(mu.segment(1, to - j)));
    sum += std::abs(c[j]);
    out[static_cast<std::size_t>(j - 1 - from)] = std::sqrt(std::max(square, 0.0) + kRounding * sum * sum * mu[0]);
  }
  return out;
}

struct Filtered {
  Eigen::MatrixXd sums;  ///< Column s = h_s(L) y.
  Index degree = 0;
  double error_bound = 0.0;
};

/// First a third of the degree that the worst case asks for. The moments found on the way then tell how far to go,
/// usually less than half of it.
Filtered filter(const internal::RowBlocks& laplacian, double domain, const Expansion& expansion,
                const Eigen::VectorXd& y, double tolerance, Index max_degree) {
  const double norm = y.norm();
  const std::vector<Index> worst_case = worst_case_degrees(expansion, norm, 0.5 * tolerance);
  const Index probe = std::min(max_degree, (*std::max_element(worst_case.begin(), worst_case.end()) + 2) / 3);
  Recurrence recurrence(laplacian, domain, expansion, y);
  recurrence.run(std::vector<Index>(worst_case.size(), probe), true);

  Filtered out;
  std::vector<Index> degrees(worst_case.size(), probe);
  for (std::size_t s = worst_case.size(); s-- > 0;) {
    const Index scale = static_cast<Index>(s);
    const auto left_out = [&](Index degree) { return expansion.tail(degree, scale) * norm; };
    if (s + 1 < degrees.size()) degrees[s] = degrees[s + 1];  // larger scales never get less than smaller ones
    double error = left_out(degrees[s]);
    const Index known = probe + static_cast<Index>(recurrence.moments().size()) - 1;
    if (error > tolerance && worst_case[s] <= known) {
      const Eigen::VectorXd c = expansion.coefficient.col(scale).head(worst_case[s] + 1);
      const auto bounds = measured_bounds(c, recurrence.moments(), probe, worst_case[s]);
      const auto bound_at = [&](Index degree) {
        return left_out(std::max(degree, worst_case[s])) +
               (degree < worst_case[s] ? bounds[static_cast<std::size_t>(degree - probe)] : 0.0);
      };
      while (bound_at(degrees[s]) > tolerance && degrees[s] < max_degree) ++degrees[s];
      error = std::min(bound_at(degrees[s]), left_out(degrees[s]));
    }
    out.error_bound = std::max(out.error_bound, error);
  }
  recurrence.run(degrees, false);
  out.sums = recurrence.sums();
  out.degree = degrees.front();
  return out;
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
  const double domain = std::min(bound, kMargin * largest_eigenvalue(laplacian, kAccuracy));
  const Index max_degree = config.max_order - 1;  // one product made L f
  Index size = 2048;
  Expansion expansion = expand(bank, domain, size);
  const auto resolved = [&] {
    const auto degrees = worst_case_degrees(expansion, norm, 0.5 * config.tolerance);
    return *std::max_element(degrees.begin(), degrees.end()) + 1 < size;
  };
  while (!resolved() && size <= 2 * max_degree) expansion = expand(bank, domain, size *= 2);

  for (Index c = 0; c < signals.cols(); ++c) {
    const auto [sums, degree, error_bound] =
        filter(blocks, domain, expansion, blocks.to_blocks(smoothed.col(c)), config.tolerance, max_degree);
    Eigen::VectorXd column(signals.rows());
    for (int s = 0; s < bank.scales(); ++s) {
      blocks.from_blocks(sums.col(s), column);
      result.coefficients.col(s * signals.cols() + c) += column;
    }
    result.order = std::max(result.order, static_cast<int>(degree) + 1);
    result.error_bound = std::max(result.error_bound, error_bound);
  }
  result.converged = result.error_bound <= config.tolerance;
  return result;
}

struct WaveletFilter::Prepared {
  SparseMatrix laplacian;
  internal::RowBlocks blocks;
  MeyerFilterBank bank;
  double domain = 0.0;
  Expansion expansion;
  std::vector<Index> degrees;  ///< Of the polynomials of h_s, not growing with s.
};

WaveletFilter::WaveletFilter(const SparseMatrix& laplacian, int scales, double tolerance) {
  TUTTI_CHECK(scales >= 2 && tolerance > 0.0, "{} scales, tolerance {}", scales, tolerance);
  // T_k grows exponentially outside of the domain, which must hold the largest eigenvalue.
  constexpr double kAccuracy = 1e-3;
  constexpr double kMargin = 1.01;
  constexpr Index kTerms = 2048;
  internal::RowBlocks blocks(laplacian);
  const double bound = largest_eigenvalue_bound(laplacian);
  const double domain = std::min(bound, kMargin * largest_eigenvalue(laplacian, kAccuracy));
  MeyerFilterBank bank(scales, domain);
  auto made = std::make_unique<Prepared>(Prepared{laplacian, std::move(blocks), bank, domain, {}, {}});
  if (domain > 0.0) {
    made->expansion = expand(bank, domain, kTerms);
    made->degrees = worst_case_degrees(made->expansion, domain, tolerance);
    for (std::size_t s = made->degrees.size() - 1; s-- > 0;)
      made->degrees[s] = std::max(made->degrees[s], made->degrees[s + 1]);
  }
  prepared_ = std::move(made);
}

WaveletFilter::~WaveletFilter() = default;
WaveletFilter::WaveletFilter(WaveletFilter&&) noexcept = default;

const MeyerFilterBank& WaveletFilter::bank() const { return prepared_->bank; }

int WaveletFilter::degree() const {
  return prepared_->degrees.empty() ? 0 : static_cast<int>(prepared_->degrees.front()) + 1;
}

Eigen::MatrixXd WaveletFilter::operator()(const Eigen::Ref<const Eigen::MatrixXd>& signals) const {
  const auto& [laplacian, blocks, bank, domain, expansion, degrees] = *prepared_;
  TUTTI_CHECK(signals.rows() == laplacian.rows(), "signals of {} nodes, graph of {}", signals.rows(), laplacian.rows());
  const Index d = signals.cols();
  Eigen::MatrixXd out(signals.rows(), bank.scales() * d);
  for (int s = 0; s < bank.scales(); ++s) out.middleCols(s * d, d) = bank.kernel(s, 0.0) * signals;
  if (degrees.empty()) return out;
  const Eigen::MatrixXd smoothed = laplacian * signals;
  Eigen::VectorXd column(signals.rows());
  for (Index c = 0; c < d; ++c) {
    Recurrence recurrence(blocks, domain, expansion, blocks.to_blocks(smoothed.col(c)));
    recurrence.run(degrees, false);
    for (int s = 0; s < bank.scales(); ++s) {
      blocks.from_blocks(recurrence.sums().col(s), column);
      out.col(s * d + c) += column;
    }
  }
  return out;
}

}  // namespace tutti::spectral
