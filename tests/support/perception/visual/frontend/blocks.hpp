// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "tutti/base/random.hpp"
#include "tutti/model/image.hpp"

namespace tutti::visual {

/// Bright and dark blocks of any size on a wall; the image begins at `shift_px`.
inline Image blocks(int width_px, int height_px, int shift_px) {
  Image image(width_px, height_px);
  Rng rng(7);
  for (int block = 0; block < 900; ++block) {
    const int left = static_cast<int>(rng.index(1200)) - shift_px, top = static_cast<int>(rng.index(600));
    const int right = left + 5 + static_cast<int>(rng.index(40)), bottom = top + 5 + static_cast<int>(rng.index(40));
    const auto grey = static_cast<std::uint8_t>(30 + rng.index(200));
    for (int y = top; y < std::min(bottom, height_px); ++y)
      for (int x = std::max(left, 0); x < std::min(right, width_px); ++x)
        image.grey[static_cast<std::size_t>(y * width_px + x)] = grey;
  }
  // Slightly rough, like any wall.
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x) {
      const auto place = static_cast<std::uint64_t>(y * 10000 + x + shift_px);
      image.grey[static_cast<std::size_t>(y * width_px + x)] += static_cast<std::uint8_t>(mixed(place) % 7U);
    }
  return image;
}

}  // namespace tutti::visual
