// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tutti::mission {

/// An image with opacity: rows from the top, four bytes per pixel: red, green, blue, opacity.
struct RgbaImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> rgba;
};

/// The bytes of a PNG file; the image must have at least one pixel.
std::string encode_png(const RgbaImage& image);

/// The text "data:image/png;base64,...", for pages that contain their pictures.
std::string data_uri(std::string_view png);

}  // namespace tutti::mission
