// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/wavelet_transform.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <mutex>
#include <numbers>
#include <span>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/spectral/internal/column_slabs.hpp"
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

/// Smallest degree of each scale's polynomial, at most `max_degree`, whose worst case meets the tolerance for a signal
/// of this norm; larger scales never get less than smaller ones.
std::vector<Index> degrees_for(const Expansion& expansion, double norm, double tolerance, Index max_degree) {
  std::vector<Index> degrees(static_cast<std::size_t>(expansion.tail.cols()));
  Index degree = 0;
  for (std::size_t s = degrees.size(); s-- > 0; degrees[s] = degree)
    while (degree < max_degree && degree + 1 < expansion.tail.rows() &&
           expansion.tail(degree, static_cast<Index>(s)) * norm > tolerance)
      ++degree;
  return degrees;
}

/// A graph laid out for many products, and the polynomials' domain. T_k grows exponentially outside of that, so it
/// holds the largest eigenvalue, found to `accuracy`, with ten times that to spare.
struct Layout {
  internal::RowBlocks blocks;
  double domain;
  Layout(const SparseMatrix& laplacian, double accuracy, double largest = 0.0)
      : blocks(laplacian),
        domain(
            std::min(largest_eigenvalue_bound(laplacian),
                     (1.0 + 10.0 * accuracy) * (largest > 0.0 ? largest : largest_eigenvalue(laplacian, accuracy)))) {}
};

/// g_s(0) f of all signals.
Eigen::MatrixXd unfiltered(const MeyerFilterBank& bank, const Eigen::Ref<const Eigen::MatrixXd>& signals) {
  Eigen::MatrixXd out(signals.rows(), bank.scales() * signals.cols());
  for (int s = 0; s < bank.scales(); ++s)
    out.middleCols(s * signals.cols(), signals.cols()) = bank.kernel(s, 0.0) * signals;
  return out;
}

/// Adds h_s(L) y of one signal to the coefficients, y = L f = column `c` of `smoothed`, by the recurrence of T_k(X) y,
/// X = (2 / domain) L - I; scale s gets no term above degrees[s].
void add_filtered(const Layout& layout, const Expansion& expansion, std::span<const Index> degrees,
                  const Eigen::MatrixXd& smoothed, Index c, Eigen::MatrixXd& coefficients) {
  Eigen::VectorXd current = layout.blocks.to_blocks(smoothed.col(c));
  Eigen::VectorXd previous = Eigen::VectorXd::Zero(current.size());
  Eigen::MatrixXd sums = current * expansion.coefficient.row(0);
  std::vector<internal::RowBlocks::Step> steps;
  auto active = degrees.size();
  for (Index k = 1; k <= degrees.front(); ++k) {
    while (degrees[active - 1] < k) --active;
    const double half = k == 1 ? 0.5 : 1.0;  // T_1 = X T_0, then T_{k+1} = 2 X T_k - T_{k-1}
    steps.push_back({half * 4.0 / layout.domain, half * -2.0, {&expansion.coefficient(k, 0), active}});
  }
  layout.blocks.run(steps, current, previous, sums);
  Eigen::VectorXd column(smoothed.rows());
  for (Index s = 0; s < sums.cols(); ++s) {
    layout.blocks.from_blocks(sums.col(s), column);
    coefficients.col(s * smoothed.cols() + c) += column;
  }
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
  ChebyshevResult result{.coefficients = unfiltered(bank, signals)};
  const Eigen::MatrixXd smoothed = laplacian * signals;
  const double norm = smoothed.size() == 0 ? 0.0 : smoothed.colwise().norm().maxCoeff();
  if (norm == 0.0) return result;  // constant on every component

  const Layout layout(laplacian, kLargestEigenvalueTolerance, config.largest_eigenvalue);
  const Index max_degree = config.max_order - 1;  // one product made L f
  Index size = 2048;
  Expansion expansion = expand(bank, layout.domain, size);
  const auto resolved = [&] { return degrees_for(expansion, norm, 0.5 * config.tolerance, size).front() + 1 < size; };
  while (!resolved() && size <= 2 * max_degree) expansion = expand(bank, layout.domain, size *= 2);

  for (Index c = 0; c < signals.cols(); ++c) {
    const double own_norm = smoothed.col(c).norm();
    const auto degrees = degrees_for(expansion, own_norm, config.tolerance, max_degree);
    add_filtered(layout, expansion, degrees, smoothed, c, result.coefficients);
    result.order = std::max(result.order, static_cast<int>(degrees.front()) + 1);
    for (std::size_t s = 0; s < degrees.size(); ++s)
      result.error_bound = std::max(result.error_bound, expansion.tail(degrees[s], static_cast<Index>(s)) * own_norm);
  }
  result.converged = result.error_bound <= config.tolerance;
  return result;
}

namespace {

/// Takes frequencies as shares of the largest, which is all that the kernels of a Meyer bank depend on: made once.
const Expansion& unit_expansion(int scales) {
  constexpr Index kTerms = 2048;
  static std::mutex mutex;
  static std::map<int, Expansion> made;
  const std::lock_guard lock(mutex);
  const auto found = made.find(scales);
  return found != made.end() ? found->second
                             : made.emplace(scales, expand(MeyerFilterBank(scales, 1.0), 1.0, kTerms)).first->second;
}

}  // namespace

namespace {

using internal::ColumnSlabs;
using Slab = ColumnSlabs::Slab;
using Slabs = std::vector<Slab>;

/// Every third column from `first` on, as many as there are lanes, or are left.
Slab slab_of(const ColumnSlabs& slabs, const Eigen::Ref<const Eigen::MatrixXd>& samples, Index first) {
  Slab out(slabs.size(), 0.0F);
  for (std::size_t lane = 0; lane < ColumnSlabs::kLanes; ++lane) {
    const Index column = first + 3 * static_cast<Index>(lane);
    if (column >= samples.cols()) break;
    for (std::size_t place = 0; place < slabs.nodes().size(); ++place)
      out[place * ColumnSlabs::kLanes + lane] = static_cast<float>(samples(slabs.nodes()[place], column));
  }
  return out;
}

/// g_s(0) f.
void add_unfiltered(const MeyerFilterBank& bank, const Slab& signals, Slabs& out) {
  for (std::size_t s = 0; s < out.size(); ++s)
    if (const auto gain = static_cast<float>(bank.kernel(static_cast<int>(s), 0.0)); gain != 0.0F)
      for (std::size_t k = 0; k < signals.size(); ++k) out[s][k] += gain * signals[k];
}

/// As the function of this name above, of all lanes at once.
void add_filtered(const ColumnSlabs& slabs, double domain, const Expansion& expansion, std::span<const Index> degrees,
                  const Slab& signals, Slabs& out) {
  Slab current(slabs.size(), 0.0F), previous(slabs.size(), 0.0F);
  slabs.step(static_cast<float>(1.0 / domain), 0.0F, signals, current, {}, out);
  for (std::size_t s = 0; s < out.size(); ++s) {
    const auto weight = static_cast<float>(expansion.coefficient(0, static_cast<Index>(s)));
    for (std::size_t k = 0; k < current.size(); ++k) out[s][k] += weight * current[k];
  }
  auto active = degrees.size();
  for (Index k = 1; k <= degrees.front(); ++k) {
    while (degrees[active - 1] < k) --active;
    const double half = k == 1 ? 0.5 : 1.0;  // T_1 = X T_0, then T_{k+1} = 2 X T_k - T_{k-1}
    const std::span weights(&expansion.coefficient(k, 0), active);
    slabs.step(static_cast<float>(half * 4.0 / domain), static_cast<float>(half * -2.0), current, previous, weights,
               out);
    std::swap(current, previous);
  }
}

void add_products(const std::vector<int>& nodes, const Slab& x, const Slab& y, const Slab& z, Eigen::MatrixXd& out) {
  for (std::size_t place = 0; place < nodes.size(); ++place) {
    const auto of = [&](const Slab& slab) {
      return Eigen::Map<const Eigen::ArrayXf>(slab.data() + place * ColumnSlabs::kLanes, ColumnSlabs::kLanes)
          .cast<double>();
    };
    const auto X = of(x), Y = of(y), Z = of(z);
    Eigen::Matrix<double, 1, 6> products;
    products << (X * X).sum(), (X * Y).sum(), (Y * Y).sum(), (X * Z).sum(), (Y * Z).sum(), (Z * Z).sum();
    out.row(nodes[place]) += products;
  }
}

}  // namespace

struct WaveletFilter::Prepared {
  SparseMatrix laplacian;
  Layout layout;
  MeyerFilterBank bank;
  const Expansion* expansion = nullptr;  ///< The bank's over domain * h_s; null: no edges.
  std::vector<Index> degrees;            ///< Its polynomials'.
};

WaveletFilter::WaveletFilter(const SparseMatrix& laplacian, int scales, double tolerance) {
  TUTTI_CHECK(scales >= 2 && tolerance > 0.0, "{} scales, tolerance {}", scales, tolerance);
  Layout layout(laplacian, 1e-3);
  const double domain = layout.domain;
  auto made =
      std::make_unique<Prepared>(Prepared{laplacian, std::move(layout), MeyerFilterBank(scales, domain), nullptr, {}});
  if (domain > 0.0) {
    made->expansion = &unit_expansion(scales);
    made->degrees = degrees_for(*made->expansion, 1.0, tolerance, made->expansion->tail.rows());
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
  const auto& [laplacian, layout, bank, expansion, degrees] = *prepared_;
  TUTTI_CHECK(signals.rows() == laplacian.rows(), "signals of {} nodes, graph of {}", signals.rows(), laplacian.rows());
  Eigen::MatrixXd out = unfiltered(bank, signals);
  if (degrees.empty()) return out;
  const Eigen::MatrixXd smoothed = laplacian * signals / layout.domain;
  for (Index c = 0; c < signals.cols(); ++c) add_filtered(layout, *expansion, degrees, smoothed, c, out);
  return out;
}

std::vector<Eigen::MatrixXd> WaveletFilter::scatter(const Eigen::Ref<const Eigen::MatrixXd>& samples) const {
  const auto& [laplacian, layout, bank, expansion, degrees] = *prepared_;
  TUTTI_CHECK(samples.rows() == laplacian.rows() && samples.cols() % 3 == 0, "{} signals of {} nodes, graph of {}",
              samples.cols(), samples.rows(), laplacian.rows());
  std::vector<Eigen::MatrixXd> out(static_cast<std::size_t>(bank.scales()), Eigen::MatrixXd::Zero(samples.rows(), 6));
  const internal::ColumnSlabs slabs(laplacian);
  constexpr auto kLanes = static_cast<Index>(internal::ColumnSlabs::kLanes);
  std::array<Slabs, 3> of_axis;
  for (Index first = 0; first < samples.cols() / 3; first += kLanes) {
    for (Index axis = 0; axis < 3; ++axis) {
      const Slab signals = slab_of(slabs, samples, 3 * first + axis);
      Slabs& filtered = of_axis[static_cast<std::size_t>(axis)];
      filtered.assign(static_cast<std::size_t>(bank.scales()), Slab(slabs.size(), 0.0F));
      add_unfiltered(bank, signals, filtered);
      if (!degrees.empty()) add_filtered(slabs, layout.domain, *expansion, degrees, signals, filtered);
    }
    for (std::size_t s = 0; s < out.size(); ++s)
      add_products(slabs.nodes(), of_axis[0][s], of_axis[1][s], of_axis[2][s], out[s]);
  }
  return out;
}

}  // namespace tutti::spectral
