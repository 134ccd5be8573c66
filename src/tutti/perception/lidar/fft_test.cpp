// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/fft.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "tutti/base/random.hpp"

namespace tutti::lidar {
namespace {

ComplexImage random_image(std::uint64_t seed) {
  Rng rng(seed);
  ComplexImage image;
  for (auto* part : {&image.re, &image.im})
    for (auto& value : *part) value = static_cast<float>(rng.normal());
  return image;
}

TEST(Fft, agreesWithTheDefinition) {
  const ComplexImage image = random_image(1);
  const ComplexImage spectrum = Fft().forward(image);
  Rng rng(2);
  for (int trial = 0; trial < 20; ++trial) {
    const int row = static_cast<int>(rng.index(kImageSize)), column = static_cast<int>(rng.index(kImageSize));
    std::complex<double> sum = 0.0;
    for (int y = 0; y < kImageSize; ++y)
      for (int x = 0; x < kImageSize; ++x) {
        const double angle = -2.0 * std::numbers::pi * (row * y + column * x) / kImageSize;
        const int k = y * kImageSize + x;
        sum += std::complex<double>(image.re[k], image.im[k]) * std::polar(1.0, angle);
      }
    EXPECT_NEAR(spectrum.re[row * kImageSize + column], sum.real(), 1e-2);
    EXPECT_NEAR(spectrum.im[row * kImageSize + column], sum.imag(), 1e-2);
  }
}

TEST(Fft, inverseUndoesForward) {
  const ComplexImage image = random_image(3);
  const Fft fft;
  const ComplexImage back = fft.inverse(fft.forward(image));
  constexpr float kScale = 1.0F / (kImageSize * kImageSize);
  for (std::size_t k = 0; k < image.re.size(); ++k) {
    ASSERT_NEAR(back.re[k] * kScale, image.re[k], 1e-5F);
    ASSERT_NEAR(back.im[k] * kScale, image.im[k], 1e-5F);
  }
}

}  // namespace
}  // namespace tutti::lidar
