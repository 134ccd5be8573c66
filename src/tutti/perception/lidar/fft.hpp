// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <complex>

namespace tutti::lidar {

inline constexpr int kImageSize = 64;

/// A complex kImageSize x kImageSize image, or its spectrum. Both are periodic; index 0 is the origin.
using ComplexImage = Eigen::Array<std::complex<float>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// f(-x) from f(x) of a square image, periodic as these: of a spectrum as well.
ComplexImage mirrored(const ComplexImage& f);

/// X(k) = sum_x f(x) exp(-2 pi i k.x / N), not normalised.
ComplexImage forward_fft(const ComplexImage& image);
/// f(x) = sum_k X(k) exp(2 pi i k.x / N), not normalised: inverse_fft(forward_fft(f)) = N^2 f.
ComplexImage inverse_fft(const ComplexImage& spectrum);

}  // namespace tutti::lidar
