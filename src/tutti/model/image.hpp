// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tutti {

/// A grey image: rows from the top, 8 bits per pixel.
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

/// Depth along the optical axis per pixel of a camera: rows from the top, in units of DepthSensor::unit_m; 0: unknown.
struct DepthImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint16_t> value;  ///< width_px * height_px
  [[nodiscard]] bool empty() const { return value.empty(); }
  friend bool operator==(const DepthImage&, const DepthImage&) = default;
};

}  // namespace tutti
