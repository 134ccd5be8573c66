// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/place_correlation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::lidar {
namespace place_correlation_test {

constexpr int kSize = PlaceViews::kSize, kCells = kSize * kSize;
using Cells = std::vector<std::complex<double>>;

int at(int row, int column) { return kSize * ((row + kSize) % kSize) + (column + kSize) % kSize; }

/// By its definition: rows, then columns.
Cells fourier(Cells in, double sign) {
  for (const bool is_rows : {true, false}) {
    Cells out(kCells);
    for (int line = 0; line < kSize; ++line)
      for (int k = 0; k < kSize; ++k)
        for (int x = 0; x < kSize; ++x)
          out[is_rows ? at(line, k) : at(k, line)] +=
              in[is_rows ? at(line, x) : at(x, line)] * std::polar(1.0, sign * 2.0 * std::numbers::pi * k * x / kSize);
    in = out;
  }
  return in;
}

/// The spectrum of an image of normals x + i y, without its shortest wavelengths, as PlaceViews reads it.
std::string random_view(Rng& rng) {
  Cells image(kCells);
  for (auto& cell : image)
    if (rng.bernoulli(0.1)) cell = std::polar(rng.uniform(0.5, 1.0), rng.uniform(0.0, 2.0 * std::numbers::pi));
  const Cells spectrum = fourier(image, -1.0);
  std::string out;
  double most = 0.0;
  for (int k = 1; k < kCells; ++k) most = std::max(most, std::abs(spectrum[k]));
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column) {
      const bool is_kept = row != kSize / 2 && column != kSize / 2 && row + column > 0;
      const std::complex<double> value = is_kept ? 127.0 / most * spectrum[at(row, column)] : 0.0;
      for (const double part : {value.real(), value.imag()}) out.push_back(static_cast<char>(std::lround(part)));
    }
  return out;
}

Cells read(const std::string& view) {
  Cells out(kCells);
  double sum = 0.0;
  for (int k = 0; k < kCells; ++k) {
    out[k] = {double(static_cast<signed char>(view[2 * k])), double(static_cast<signed char>(view[2 * k + 1]))};
    sum += std::norm(out[k]);
  }
  for (auto& value : out) value /= std::sqrt(sum);
  return out;
}

/// Over all shifts of b, and of b turned by half, which negates its normals.
double highest_by_definition(const std::string& a, const std::string& b) {
  const Cells of_a = read(a), of_b = read(b);
  double best = 0.0;
  for (const bool is_turned : {false, true}) {
    Cells product(kCells);
    for (int row = 0; row < kSize; ++row)
      for (int column = 0; column < kSize; ++column)
        product[at(row, column)] =
            of_a[at(row, column)] * std::conj(is_turned ? -of_b[at(-row, -column)] : of_b[at(row, column)]);
    for (const auto& value : fourier(product, 1.0)) best = std::max(best, value.real());
  }
  return best;
}

TEST(PlaceViews, FindTheHighestPointOfTheCorrelation) {
  Rng rng(1);
  for (int trial = 0; trial < 3; ++trial) {
    const std::string a = random_view(rng), b = random_view(rng);
    EXPECT_NEAR(PlaceViews(a).highest(b), highest_by_definition(a, b), 1e-5);
    EXPECT_NEAR(PlaceViews(a).highest(a), 1.0, 1e-5);
  }
}

TEST(PlaceViews, AreTheBestOfAll) {
  Rng rng(2);
  const std::string a = random_view(rng), b = random_view(rng), c = random_view(rng);
  EXPECT_EQ(PlaceViews(a + b).highest(c), std::max(PlaceViews(a).highest(c), PlaceViews(b).highest(c)));
  EXPECT_EQ(PlaceViews(c).highest(a + b), std::max(PlaceViews(c).highest(a), PlaceViews(c).highest(b)));
  EXPECT_EQ(PlaceViews(a).highest(""), 0.0F);
  EXPECT_EQ(PlaceViews("").highest(a), 0.0F);
  EXPECT_EQ(PlaceViews(a).highest(b + "left over"), PlaceViews(a).highest(b));
  const std::string nothing(PlaceViews::kViewBytes, '\0');
  EXPECT_EQ(PlaceViews(nothing).highest(a), 0.0F);
}

TEST(PlaceViews, AreTheSameToTheBitOnAnyProcessor) {
  Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    const std::string a = random_view(rng), b = random_view(rng);
    const PlaceViews views(a);
    EXPECT_EQ(views.highest(b), views.highest_anywhere(b));
  }
}

}  // namespace place_correlation_test
}  // namespace tutti::lidar
