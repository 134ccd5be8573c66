// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tutti::mission {

/// Rows from above, four bytes a pixel: red, green, blue, opacity.
struct Image {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> rgba;
};

/// The bytes of a PNG file; the image has at least one pixel.
std::string encode_png(const Image& image);

/// For pages that hold their pictures themselves: "data:image/png;base64,...".
std::string data_uri(std::string_view png);

}  // namespace tutti::mission
