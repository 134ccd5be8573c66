// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/png.hpp"

#include <png.h>

#include "tutti/base/check.hpp"

namespace tutti::mission {

std::string encode_png(const RgbaImage& image) {
  TUTTI_CHECK(image.width > 0 && image.height > 0 && image.rgba.size() == 4 * image.width * image.height);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.format = PNG_FORMAT_RGBA;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  const int written = png_image_write_to_memory(&png, bytes.data(), &size, 0, image.rgba.data(), 0, nullptr);
  TUTTI_CHECK(written != 0);  // only memory could be wanting
  bytes.resize(size);
  return bytes;
}

std::string data_uri(std::string_view png) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out = "data:image/png;base64,";
  out.reserve(out.size() + (png.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < png.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (i + k < png.size() ? static_cast<std::uint8_t>(png[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= png.size() ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

}  // namespace tutti::mission
