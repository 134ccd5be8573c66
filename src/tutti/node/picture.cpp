// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/picture.hpp"

#include <cstddef>

#include "tutti/model/map_mark.hpp"

namespace tutti::node {
namespace {

struct Size {
  std::uint64_t width = 0, height = 0;
};

/// Most significant byte first; 0 beyond the end.
std::uint64_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint64_t out = 0;
  if (at + count > bytes.size()) return 0;
  for (const char c : bytes.substr(at, count)) out = out << 8U | static_cast<unsigned char>(c);
  return out;
}

/// IHDR is the first chunk (https://www.w3.org/TR/png-3, 11.2.1).
Size size_of_png(std::string_view bytes) { return {number_at(bytes, 16, 4), number_at(bytes, 20, 4)}; }

/// The largest of all frame headers (ITU-T T.81, B.2.2); without one nothing can be shown.
Size size_of_jpeg(std::string_view bytes) {
  Size out;
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (bytes[at] != '\xff') break;
    const std::uint64_t marker = number_at(bytes, at + 1, 1);
    if (marker == 0xff) {  // fills up
      ++at;
      continue;
    }
    if (marker == 0xda) break;  // the picture itself
    const bool is_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame && number_at(bytes, at + 5, 2) * number_at(bytes, at + 7, 2) >= out.width * out.height)
      out = {number_at(bytes, at + 7, 2), number_at(bytes, at + 5, 2)};
    at += 2 + number_at(bytes, at + 2, 2);
  }
  return out;
}

}  // namespace

Status check_picture(std::string_view bytes) {
  const std::string_view type = picture_type(bytes);
  if (type.empty()) return fail(ErrorCode::invalid, "the photo is neither a JPEG nor a PNG file");
  const Size size = type == "image/png" ? size_of_png(bytes) : size_of_jpeg(bytes);
  if (size.height == 0 || size.width <= kMostPixels / size.height) return {};
  return fail(ErrorCode::invalid, "the photo has {} x {} pixels, expected at most {} in all: make it smaller first",
              size.width, size.height, kMostPixels);
}

}  // namespace tutti::node
