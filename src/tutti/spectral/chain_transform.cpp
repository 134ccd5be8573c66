// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/chain_transform.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace tutti::spectral {
namespace {

using Complex = std::complex<double>;

/// The spectrum of a signal followed by its mirror image: Y_k = 2 e^{i pi k / 2n} sum_m f_m cos(pi k (m + 1/2) / n), so
/// a function of lambda_k = lambda_{2n-k} acts on it as it does on the graph's spectrum.
void mirrored_spectrum(Eigen::FFT<double>& fft, const Eigen::VectorXd& f, std::vector<Complex>& out) {
  const auto n = static_cast<std::size_t>(f.size());
  std::vector<double> mirrored(2 * n);
  for (std::size_t m = 0; m < n; ++m) mirrored[m] = mirrored[2 * n - 1 - m] = f(static_cast<Eigen::Index>(m));
  fft.fwd(out, mirrored);
}

}  // namespace

double chain_eigenvalue(Eigen::Index k, Eigen::Index n) {
  return 2.0 - 2.0 * std::cos(std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
}

Eigen::Index fast_chain_length(Eigen::Index n) {
  for (Eigen::Index length = std::max<Eigen::Index>(1, n);; ++length) {
    Eigen::Index rest = length;
    for (const Eigen::Index factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return length;
  }
}

Eigen::MatrixXd chain_transform(const MeyerFilterBank& bank, const Eigen::MatrixXd& signals) {
  const Eigen::Index n = signals.rows();
  const Eigen::Index d = signals.cols();
  Eigen::MatrixXd W(n, bank.scales() * d);
  if (n == 0) return W;
  Eigen::MatrixXd kernel(n + 1, bank.scales());  // g_s(lambda_k); the mirrored spectrum also holds k = n
  for (Eigen::Index k = 0; k <= n; ++k)
    for (int s = 0; s < bank.scales(); ++s) kernel(k, s) = bank.kernel(s, chain_eigenvalue(k, n));

  Eigen::FFT<double> fft;
  std::vector<Complex> spectrum;
  std::vector<Complex> band(static_cast<std::size_t>(2 * n));
  std::vector<double> filtered;
  for (Eigen::Index c = 0; c < d; ++c) {
    mirrored_spectrum(fft, signals.col(c), spectrum);
    for (int s = 0; s < bank.scales(); ++s) {
      for (Eigen::Index k = 0; k < 2 * n; ++k)
        band[static_cast<std::size_t>(k)] =
            kernel(k <= n ? k : 2 * n - k, s) * spectrum[static_cast<std::size_t>(k)];  // eq. (7)
      fft.inv(filtered, band);
      W.col(s * d + c) = Eigen::Map<const Eigen::VectorXd>(filtered.data(), n);
    }
  }
  return W;
}

}  // namespace tutti::spectral
