// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tutti {

/// A grey image, row by row from the top, 8 bits a pixel.
struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> grey;  ///< width_px * height_px

  Image() = default;
  Image(int width, int height)
      : width_px(width), height_px(height), grey(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}
  [[nodiscard]] bool empty() const { return grey.empty(); }
  friend bool operator==(const Image&, const Image&) = default;
};

/// How far away what a camera's pixels see is, row by row from the top, in units of a DepthSensor; 0: not known.
struct DepthImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint16_t> value;  ///< width_px * height_px
  [[nodiscard]] bool empty() const { return value.empty(); }
  friend bool operator==(const DepthImage&, const DepthImage&) = default;
};

}  // namespace tutti
