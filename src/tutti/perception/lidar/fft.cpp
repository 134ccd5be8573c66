// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/fft.hpp"

#include <unsupported/Eigen/FFT>

namespace tutti::lidar {
namespace {

/// `transform(out, in)` of every row, then of every column.
template <class Transform>
ComplexImage of_rows_and_columns(ComplexImage image, const Transform& transform) {
  ComplexImage out(kImageSize, kImageSize);
  for (int pass = 0; pass < 2; ++pass) {
    for (int row = 0; row < kImageSize; ++row) transform(&out(row, 0), &image(row, 0));
    image = out.transpose();
  }
  return image;
}

}  // namespace

ComplexImage mirrored(const ComplexImage& f) {
  const Eigen::Index rest = f.rows() - 1;
  ComplexImage out(f.rows(), f.cols());
  out(0, 0) = f(0, 0);
  out.row(0).tail(rest) = f.row(0).tail(rest).reverse();
  out.col(0).tail(rest) = f.col(0).tail(rest).reverse();
  out.bottomRightCorner(rest, rest) = f.bottomRightCorner(rest, rest).reverse();
  return out;
}

ComplexImage forward_fft(const ComplexImage& image) {
  Eigen::FFT<float> fft;
  return of_rows_and_columns(image, [&](auto* out, const auto* in) { fft.fwd(out, in, kImageSize); });
}

ComplexImage inverse_fft(const ComplexImage& spectrum) {
  Eigen::FFT<float> fft(Eigen::default_fft_impl<float>{}, Eigen::FFT<float>::Unscaled);
  return of_rows_and_columns(spectrum, [&](auto* out, const auto* in) { fft.inv(out, in, kImageSize); });
}

}  // namespace tutti::lidar
