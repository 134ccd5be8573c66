// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/fft.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "tutti/base/random.hpp"

namespace tutti::lidar {
namespace fft_test {

ComplexImage random_image(std::uint64_t seed) {
  Rng rng(seed);
  return ComplexImage::NullaryExpr(kImageSize, kImageSize, [&] {
    const auto re = static_cast<float>(rng.normal());
    return std::complex<float>(re, static_cast<float>(rng.normal()));
  });
}

TEST(Fft, agreesWithTheDefinition) {
  const ComplexImage image = random_image(1);
  const ComplexImage spectrum = forward_fft(image);
  Rng rng(2);
  for (int trial = 0; trial < 20; ++trial) {
    const int row = static_cast<int>(rng.index(kImageSize)), column = static_cast<int>(rng.index(kImageSize));
    std::complex<double> sum = 0.0;
    for (int y = 0; y < kImageSize; ++y)
      for (int x = 0; x < kImageSize; ++x) {
        const double angle = -2.0 * std::numbers::pi * (row * y + column * x) / kImageSize;
        sum += std::complex<double>(image(y, x)) * std::polar(1.0, angle);
      }
    EXPECT_LT(std::abs(std::complex<double>(spectrum(row, column)) - sum), 1e-2);
  }
}

TEST(Fft, inverseUndoesForward) {
  const ComplexImage image = random_image(3);
  const ComplexImage back = inverse_fft(forward_fft(image));
  EXPECT_LT((back / static_cast<float>(kImageSize * kImageSize) - image).abs().maxCoeff(), 1e-5F);
}

}  // namespace fft_test
}  // namespace tutti::lidar
