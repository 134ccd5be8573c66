// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

namespace tutti::lidar {

inline constexpr int kImageSize = 64;

/// Complex kImageSize x kImageSize image, row-major, real and imaginary parts apart; also its spectrum. Both are
/// periodic; index 0 is the origin.
struct ComplexImage {
  std::vector<float> re = std::vector<float>(kImageSize * kImageSize, 0.0F);
  std::vector<float> im = std::vector<float>(kImageSize * kImageSize, 0.0F);
};

/// Two-dimensional discrete Fourier transform of exactly this size (radix 2 [Cooley & Tukey 1965]).
class Fft {
 public:
  Fft();
  /// X(k) = sum_x f(x) exp(-2 pi i k.x / N), not normalised.
  [[nodiscard]] ComplexImage forward(const ComplexImage& image) const;
  /// f(x) = sum_k X(k) exp(2 pi i k.x / N), not normalised: inverse(forward(f)) = N^2 f.
  [[nodiscard]] ComplexImage inverse(const ComplexImage& spectrum) const;

 private:
  using Part = std::vector<float>;
  void transform(const Part& re, const Part& im, Part& out_re, Part& out_im) const;
  void transform_columns(const Part& re, const Part& im, Part& out_re, Part& out_im) const;

  std::array<float, kImageSize / 2> cosine_{}, sine_{};  // of 2 pi k / N
  std::array<int, kImageSize> reversed_{};               // bits of the index in reverse order
};

}  // namespace tutti::lidar
