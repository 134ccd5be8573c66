// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/depth.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstring>

#include "tutti/bags/internal/cursor.hpp"
#include "tutti/bags/internal/packed_picture.hpp"
#include "tutti/bags/picture.hpp"
#include "tutti/bags/transform_tree.hpp"

namespace tutti::bags {
namespace {

using internal::Cursor;

constexpr std::string_view kMillimetres = "16UC1", kMetres = "32FC1", kGrey16 = "mono16";
constexpr std::size_t kCompressedDepthHeader = 12;  // int32 format, float32 A, float32 B

std::uint16_t in_mm(float depth_m) {
  constexpr float kMost_m = 65.5F;
  return depth_m > 0.0F && depth_m <= kMost_m ? static_cast<std::uint16_t>(std::lround(depth_m / kDepthUnit_m))
                                              : std::uint16_t{0};
}

template <class T>
T number_at(const char* at, bool is_big) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, at, sizeof(T));
  if (is_big != (std::endian::native == std::endian::big)) std::reverse(bytes, bytes + sizeof(T));
  return std::bit_cast<T>(bytes);
}

/// Every pixel of the message as `to_mm` has it.
template <class T, class ToMm>
DepthImage converted(const RosImage& message, const ToMm& to_mm) {
  DepthImage out{static_cast<int>(message.width), static_cast<int>(message.height), {}};
  out.value.reserve(std::size_t{message.width} * message.height);
  for (std::uint32_t y = 0; y < message.height; ++y) {
    const char* at = message.data.data() + std::size_t{y} * message.step;
    for (std::uint32_t x = 0; x < message.width; ++x, at += sizeof(T))
      out.value.push_back(to_mm(number_at<T>(at, message.is_bigendian)));
  }
  return out;
}

/// The header chunk that a PNG file begins with.
struct PngHeader {
  std::uint32_t width = 0, height = 0;
  bool is_grey16 = false;
};
PngHeader header_of(std::string_view png) {
  constexpr std::size_t kSignature = 8;
  Cursor in(png, Cursor::Order::big);
  in.take(kSignature, "signature");
  in.number<std::uint32_t>("length");
  if (in.take(4, "chunk") != "IHDR") return {};
  PngHeader out;
  out.width = in.number<std::uint32_t>("width");
  out.height = in.number<std::uint32_t>("height");
  const auto bits = in.number<std::uint8_t>("bits"), colour = in.number<std::uint8_t>("colour");
  out.is_grey16 = bits == 16 && colour == 0;
  return in.ok() ? out : PngHeader{};
}

}  // namespace

std::string_view png_of(std::string_view data) {
  constexpr std::string_view kBegin = "\x89PNG";
  if (data.starts_with(kBegin)) return data;
  if (data.size() > kCompressedDepthHeader && data.substr(kCompressedDepthHeader).starts_with(kBegin))
    return data.substr(kCompressedDepthHeader);
  return {};
}

ImageLayout layout_of(const RosImage& message) {
  return {message.encoding, frame_name(message.header.frame_id), message.width, message.height};
}

ImageLayout layout_of(const RosCompressedImage& message) {
  const PngHeader header = header_of(png_of(message.data));
  const std::size_t end = message.format.find(';');
  ImageLayout out{message.format.substr(0, end), frame_name(message.header.frame_id), header.width, header.height};
  if (!is_depth("", out.encoding))
    if (std::string other = internal::other_encoding(message.format, message.data); !other.empty())
      out.encoding = std::move(other);
  if (header.is_grey16 && end == std::string::npos && !is_depth("", out.encoding)) out.encoding = kMillimetres;
  return out;
}

bool is_depth(std::string_view topic, std::string_view encoding) {
  return encoding == kMillimetres || encoding == kMetres || topic.ends_with("/compressedDepth") ||
         (encoding == kGrey16 && topic.find("depth") != std::string_view::npos);
}

std::uint32_t depth_bytes(std::string_view encoding) {
  return encoding == kMetres ? sizeof(float) : sizeof(std::uint16_t);
}

Status check_like_first(const ImageLayout& layout, const ImageLayout& first) {
  if (layout.encoding != first.encoding)
    return fail(ErrorCode::invalid, "encoding '{:.40}', expected '{:.40}' as of the first", layout.encoding,
                first.encoding);
  if (layout.frame != first.frame)
    return fail(ErrorCode::invalid, "frame '{:.80}', expected '{:.80}' as of the first", layout.frame, first.frame);
  if (layout.width_px != first.width_px || layout.height_px != first.height_px)
    return fail(ErrorCode::invalid, "{} x {} pixels, expected {} x {} as of the first", layout.width_px,
                layout.height_px, first.width_px, first.height_px);
  return {};
}

Result<DepthImage> to_depth(const RosImage& message) {
  const bool is_metres = message.encoding == kMetres;
  if (!is_metres && message.encoding != kMillimetres && message.encoding != kGrey16)
    return fail(ErrorCode::unsupported, "encoding '{:.40}', expected 16UC1 or 32FC1 of a depth image",
                message.encoding);
  if (auto ok = check_rows(message, depth_bytes(message.encoding)); !ok) return tl::unexpected(ok.error());
  if (is_metres) return converted<float>(message, in_mm);
  return converted<std::uint16_t>(message, [](std::uint16_t depth_mm) { return depth_mm; });
}

Result<DepthImage> to_depth(const RosCompressedImage& message, formats::ExpectedSize expected) {
  const std::string_view png = png_of(message.data);
  const std::string encoding = layout_of(message).encoding;
  const bool is_inverse = encoding == kMetres;
  if (png.empty() || (is_inverse && png.size() == message.data.size()))
    return fail(ErrorCode::unsupported, "format '{:.60}' with {} bytes, expected a PNG image as compressedDepth has",
                message.format, message.data.size());
  auto depth = formats::decode_depth(png, "depth", expected);
  if (!depth || !is_inverse) return depth;
  const auto a = number_at<float>(message.data.data() + 4, false), b = number_at<float>(message.data.data() + 8, false);
  for (std::uint16_t& value : depth->value)
    value = value == 0 ? std::uint16_t{0} : in_mm(a / (static_cast<float>(value) - b));
  return depth;
}

}  // namespace tutti::bags
