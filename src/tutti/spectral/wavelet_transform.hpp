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

struct ChebyshevConfig {
  double tolerance = 1e-3;  ///< Largest error allowed in any coefficient, in the signal's unit.
  int max_order = 4000;     ///< Most products with the Laplacian to spend on one signal.
};

struct ChebyshevResult {
  Eigen::MatrixXd coefficients;
  int order = 0;             ///< Products with the Laplacian of the most expensive signal.
  double error_bound = 0.0;  ///< No coefficient is further than this from the exact one (rounding aside).
  bool converged = true;     ///< error_bound <= tolerance; false when max_order was too small.
};

/// Coefficients by polynomials of the Laplacian: sparse products only. The order follows from the requested tolerance.
/// A constant per connected component passes scale 0 unchanged and the other scales not at all, exactly.
/// bank.lambda_max() below the graph's largest eigenvalue is allowed (see MeyerFilterBank), only slower.
[[nodiscard]] ChebyshevResult chebyshev_transform(const SparseMatrix& laplacian, const MeyerFilterBank& bank,
                                                  const Eigen::MatrixXd& signals, const ChebyshevConfig& config = {});

/// The Meyer bank of one graph by polynomials whose degree depends on the bank alone, so that the transform is one
/// linear map: what it does to samples of an error says what it does to the error. For many signals of one graph.
class WaveletFilter {
 public:
  /// A Laplacian, scales >= 2. No kernel is off by more than `tolerance` anywhere, and in proportion to the frequency
  /// less near zero; a constant per connected component passes exactly.
  WaveletFilter(const SparseMatrix& laplacian, int scales, double tolerance = 0.05);
  ~WaveletFilter();
  WaveletFilter(WaveletFilter&&) noexcept;

  [[nodiscard]] const MeyerFilterBank& bank() const;
  [[nodiscard]] int degree() const;  ///< Products with the Laplacian per signal.
  /// nodes x d -> nodes x (scales * d), ordered as above.
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::Ref<const Eigen::MatrixXd>& signals) const;
  /// Of many samples of a vector at every node, three signals each, in single precision: per scale nodes x 6, the sums
  /// over the samples of the products of their coefficients: xx, xy, yy, xz, yz, zz.
  [[nodiscard]] std::vector<Eigen::MatrixXd> scatter(const Eigen::Ref<const Eigen::MatrixXd>& samples) const;

 private:
  struct Prepared;
  std::unique_ptr<const Prepared> prepared_;
};

}  // namespace tutti::spectral
