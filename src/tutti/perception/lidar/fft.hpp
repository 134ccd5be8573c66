// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <complex>

namespace tutti::lidar {

inline constexpr int kImageSize = 64;

/// A complex kImageSize x kImageSize image, or its spectrum. Both are periodic; index 0 is the origin.
using ComplexImage = Eigen::Array<std::complex<float>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// f(-x) from f(x) of a square image, periodic as these: of a spectrum as well.
template <class Image>
Image mirrored(const Image& f) {
  const Eigen::Index rest = f.rows() - 1;
  Image out(f.rows(), f.cols());
  out(0, 0) = f(0, 0);
  out.row(0).tail(rest) = f.row(0).tail(rest).reverse();
  out.col(0).tail(rest) = f.col(0).tail(rest).reverse();
  out.bottomRightCorner(rest, rest) = f.bottomRightCorner(rest, rest).reverse();
  return out;
}

/// X(k) = sum_x f(x) exp(-2 pi i k.x / N), not normalised.
ComplexImage forward_fft(const ComplexImage& image);
/// f(x) = sum_k X(k) exp(2 pi i k.x / N), not normalised: inverse_fft(forward_fft(f)) = N^2 f.
ComplexImage inverse_fft(const ComplexImage& spectrum);

}  // namespace tutti::lidar
