// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "tutti/spectral/graph.hpp"
#include "tutti/spectral/meyer.hpp"
#include "tutti/spectral/spectrum.hpp"

/// Wavelet coefficients of signals on a graph: W_{s,n} = psi_{s,n}^T f with psi_{s,n} = U g_s(Lambda) U^T delta_n (the
/// paper's eq. 7 and below), that is row n of g_s(L) f. psi itself (nodes x nodes x scales) is never formed.
/// Signals are the columns of an n x d matrix; coefficients an n x (scales * d) matrix whose column s * d + c holds
/// scale s of signal c.
namespace tutti::spectral {

/// Coefficients by the full spectrum: exact to rounding. Independent of the eigenvectors' signs and of the choice of
/// basis inside repeated eigenvalues.
[[nodiscard]] Eigen::MatrixXd exact_transform(const Spectrum& spectrum, const MeyerFilterBank& bank,
                                              const Eigen::MatrixXd& signals);

/// How well a transform needs to know the largest eigenvalue, relative. Two banks that share the value share its error,
/// which is but a shift of the bands by as much.
inline constexpr double kLargestEigenvalueTolerance = 1e-8;

struct ChebyshevConfig {
  double tolerance = 1e-3;  ///< Largest error allowed in any coefficient, in the signal's unit.
  int max_order = 4000;     ///< Limit on the products with the Laplacian per signal.
  /// The Laplacian's, from largest_eigenvalue() with kLargestEigenvalueTolerance; 0: it is computed.
  double largest_eigenvalue = 0.0;
};

struct ChebyshevResult {
  Eigen::MatrixXd coefficients;
  int order = 0;             ///< Products with the Laplacian that the most expensive signal took.
  double error_bound = 0.0;  ///< No coefficient is further than this from the exact one (rounding aside).
  bool converged = true;     ///< error_bound <= tolerance; false when max_order was too small.
};

/// Coefficients by Chebyshev polynomials of the Laplacian, which take sparse products only. The order follows from the
/// requested tolerance. A signal that is constant on every connected component passes scale 0 unchanged and the other
/// scales not at all, exactly. A bank.lambda_max() below the graph's largest eigenvalue is allowed (see
/// MeyerFilterBank) and costs a higher order. Numerical failure is in the result (`converged`).
[[nodiscard]] ChebyshevResult chebyshev_transform(const SparseMatrix& laplacian, const MeyerFilterBank& bank,
                                                  const Eigen::MatrixXd& signals, const ChebyshevConfig& config = {});

/// The Meyer bank of one graph by Chebyshev polynomials whose degree depends on the bank alone, not on the signal. The
/// transform is therefore one linear map, and the spread of transformed samples of an error is that of the transformed
/// error. Prepared once for many signals of one graph; const calls may run in several threads.
class WaveletFilter {
 public:
  /// `scales` >= 2, `tolerance` > 0. At frequency x no kernel is off by more than tolerance * x / lambda_max; a signal
  /// that is constant on every connected component passes exactly.
  WaveletFilter(const SparseMatrix& laplacian, int scales, double tolerance = 0.05);
  ~WaveletFilter();
  WaveletFilter(WaveletFilter&&) noexcept;

  /// The bank, whose lambda_max is the graph's largest eigenvalue or up to about 1 % more.
  [[nodiscard]] const MeyerFilterBank& bank() const;
  [[nodiscard]] int degree() const;  ///< Products with the Laplacian per signal.
  /// Coefficients, n x (scales * d), of n x d signals, ordered as at the top of this header.
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::Ref<const Eigen::MatrixXd>& signals) const;
  /// Second moments of transformed samples of a 3-vector at every node, in single precision. `samples`: n x 3k, the
  /// columns 3j, 3j + 1, 3j + 2 being x, y, z of sample j. Per scale an n x 6 matrix: at every node the sums, over the
  /// samples, of the products xx, xy, yy, xz, yz, zz of its coefficients.
  [[nodiscard]] std::vector<Eigen::MatrixXd> scatter(const Eigen::Ref<const Eigen::MatrixXd>& samples) const;

 private:
  struct Prepared;
  std::unique_ptr<const Prepared> prepared_;
};

}  // namespace tutti::spectral
