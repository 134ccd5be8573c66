// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/fft.hpp"

#include <cmath>
#include <numbers>

namespace tutti::lidar {
namespace {

constexpr int kN = kImageSize;
constexpr int kStrip = 16;  // columns transformed together: 16 KB, which stays in the first-level cache

using Row = float[kStrip];

/// (a, b) <- (a + w b, a - w b) with w = c - i s, on all columns of a strip.
inline void butterfly(Row& a_re, Row& a_im, Row& b_re, Row& b_im, float c, float s) {
  for (int k = 0; k < kStrip; ++k) {
    const float re = c * b_re[k] + s * b_im[k];
    const float im = c * b_im[k] - s * b_re[k];
    b_re[k] = a_re[k] - re;
    b_im[k] = a_im[k] - im;
    a_re[k] += re;
    a_im[k] += im;
  }
}

}  // namespace

Fft::Fft() {
  for (int k = 0; k < kN / 2; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kN;
    cosine_[k] = static_cast<float>(std::cos(angle));
    sine_[k] = static_cast<float>(std::sin(angle));
  }
  for (int k = 0, j = 0; k < kN; ++k) {
    reversed_[k] = j;
    int bit = kN >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j |= bit;
  }
}

/// One-dimensional transform of every column; the result is transposed.
void Fft::transform_columns(const Part& re, const Part& im, Part& out_re, Part& out_im) const {
  alignas(64) Row strip_re[kN];
  alignas(64) Row strip_im[kN];
  for (int first = 0; first < kN; first += kStrip) {
    for (int row = 0; row < kN; ++row)
      for (int k = 0; k < kStrip; ++k) {
        strip_re[reversed_[row]][k] = re[row * kN + first + k];
        strip_im[reversed_[row]][k] = im[row * kN + first + k];
      }
    for (int half = 1; half < kN; half *= 2)
      for (int block = 0; block < kN; block += 2 * half)
        for (int j = 0; j < half; ++j) {
          const int a = block + j, b = a + half, twiddle = j * (kN / 2 / half);
          butterfly(strip_re[a], strip_im[a], strip_re[b], strip_im[b], cosine_[twiddle], sine_[twiddle]);
        }
    for (int k = 0; k < kStrip; ++k)
      for (int row = 0; row < kN; ++row) {
        out_re[(first + k) * kN + row] = strip_re[row][k];
        out_im[(first + k) * kN + row] = strip_im[row][k];
      }
  }
}

void Fft::transform(const Part& re, const Part& im, Part& out_re, Part& out_im) const {
  ComplexImage columns_done;
  transform_columns(re, im, columns_done.re, columns_done.im);
  transform_columns(columns_done.re, columns_done.im, out_re, out_im);
}

ComplexImage Fft::forward(const ComplexImage& image) const {
  ComplexImage out;
  transform(image.re, image.im, out.re, out.im);
  return out;
}

ComplexImage Fft::inverse(const ComplexImage& spectrum) const {
  ComplexImage out;  // swapping real and imaginary parts before and after conjugates the transform's kernel
  transform(spectrum.im, spectrum.re, out.im, out.re);
  return out;
}

}  // namespace tutti::lidar
