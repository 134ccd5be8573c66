// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace tutti::lidar {

/// Views of a place from above, ready to be correlated with those of many others. A view is the 32 x 32 longest
/// wavelengths of the spectrum of its wall normals (x + i y), row by row, both parts of each as a number of 8 bits;
/// those without a mirror image (row and column 16) are 0.
class PlaceViews {
 public:
  static constexpr int kSize = 32;
  static constexpr std::size_t kViewBytes = 2 * kSize * kSize;

  /// One view after the other, kViewBytes each; what is left over is not read.
  explicit PlaceViews(std::span<const char> bytes);
  ~PlaceViews();
  /// The highest point of the correlation of any view with any of the others, as they are or turned by half a turn,
  /// over all shifts; at most 1. 0 when one of both has none.
  [[nodiscard]] float highest(std::span<const char> others) const;
  /// The same to the bit without AVX2, with which highest() is two to three times as fast.
  [[nodiscard]] float highest_anywhere(std::span<const char> others) const;

 private:
  struct View;
  std::unique_ptr<View[]> views_;
  std::size_t count_ = 0;
};

}  // namespace tutti::lidar
