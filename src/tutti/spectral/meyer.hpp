// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti::spectral {

/// Meyer wavelet kernels g_s on graph frequencies [0, lambda_max], scale 0 = largest (low-pass), scale S - 1 =
/// smallest. With t_j = 4 / (3 lambda_max) 2^(S-2-j), j = 0 .. S - 2:  g_0(x) = phi(t_0 x),  g_{j+1}(x) = psi(t_j x);
/// the definition of PyGSP, which the paper's authors use. g_0 is 1 up to lambda_max / 2^(S-1); scale s > 0 lives on
/// [lambda_max 2^(s-S), lambda_max 2^(s-S+2)). On [0, lambda_max] the squares sum to 1 (tight frame: the transform
/// keeps the signal's energy). Above lambda_max the last band rolls off to 0 at 2 lambda_max and the frame is lost:
/// build the bank with the largest eigenvalue of all graphs that it is to compare. A bank of one scale is the all-pass
/// filter.
class MeyerFilterBank {
 public:
  /// scales >= 1; lambda_max >= 0, where 0 (a graph without edges) makes scale 0 pass everything at 0.
  MeyerFilterBank(int scales, double lambda_max);

  [[nodiscard]] int scales() const { return scales_; }
  [[nodiscard]] double lambda_max() const { return lambda_max_; }
  /// g_scale(lambda); 0 <= scale < scales(). Rounding below 0 counts as 0.
  [[nodiscard]] double kernel(int scale, double lambda) const;

 private:
  int scales_;
  double lambda_max_;
};

}  // namespace tutti::spectral
