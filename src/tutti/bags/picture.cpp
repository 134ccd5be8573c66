// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/picture.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "tutti/model/picture_bits.hpp"

namespace tutti::bags {
namespace {

enum class Colour : std::uint8_t { grey, rgb, bgr, bayer };

/// How a pixel lies in its row.
struct PixelLayout {
  std::string_view name;
  Colour colour = Colour::grey;
  std::uint32_t samples = 1;  ///< In a pixel.
  std::uint32_t first = 0;    ///< The sample to begin with.
  bool is_deep = false;       ///< 16 bits a sample.
};
constexpr bool kDeep = true;
constexpr std::array kLayouts{
    PixelLayout{"mono8"},
    PixelLayout{"8UC1"},
    PixelLayout{"rgb8", Colour::rgb, 3},
    PixelLayout{"bgr8", Colour::bgr, 3},
    PixelLayout{"8UC3", Colour::bgr, 3},
    PixelLayout{"rgba8", Colour::rgb, 4},
    PixelLayout{"bgra8", Colour::bgr, 4},
    PixelLayout{"8UC4", Colour::bgr, 4},
    PixelLayout{"bayer_rggb8", Colour::bayer},
    PixelLayout{"bayer_bggr8", Colour::bayer},
    PixelLayout{"bayer_gbrg8", Colour::bayer},
    PixelLayout{"bayer_grbg8", Colour::bayer},
    PixelLayout{"yuv422", Colour::grey, 2, 1},  // U Y V Y
    PixelLayout{"uyvy", Colour::grey, 2, 1},
    PixelLayout{"yuv422_yuy2", Colour::grey, 2},  // Y U Y V
    PixelLayout{"yuyv", Colour::grey, 2},
    PixelLayout{"yuy2", Colour::grey, 2},
    PixelLayout{"nv12"},  // a plane of Y, behind it U and V
    PixelLayout{"nv21"},
    PixelLayout{"nv24"},
    PixelLayout{"mono16", Colour::grey, 1, 0, kDeep},
    PixelLayout{"rgb16", Colour::rgb, 3, 0, kDeep},
    PixelLayout{"bgr16", Colour::bgr, 3, 0, kDeep},
    PixelLayout{"16UC3", Colour::bgr, 3, 0, kDeep},
    PixelLayout{"rgba16", Colour::rgb, 4, 0, kDeep},
    PixelLayout{"bgra16", Colour::bgr, 4, 0, kDeep},
    PixelLayout{"16UC4", Colour::bgr, 4, 0, kDeep},
    PixelLayout{"bayer_rggb16", Colour::bayer, 1, 0, kDeep},
    PixelLayout{"bayer_bggr16", Colour::bayer, 1, 0, kDeep},
    PixelLayout{"bayer_gbrg16", Colour::bayer, 1, 0, kDeep},
    PixelLayout{"bayer_grbg16", Colour::bayer, 1, 0, kDeep},
};

const PixelLayout* pixel_layout_of(std::string_view encoding) {
  const auto at = std::ranges::find(kLayouts, encoding, &PixelLayout::name);
  return at == kLayouts.end() ? nullptr : &*at;
}

std::uint32_t byte_at(const std::uint8_t* at) { return *at; }
std::uint32_t little_at(const std::uint8_t* at) { return at[0] | std::uint32_t{at[1]} << 8U; }
std::uint32_t big_at(const std::uint8_t* at) { return at[1] | std::uint32_t{at[0]} << 8U; }

template <class Sample, std::uint32_t (*sample_at)(const std::uint8_t*)>
Sample mean_of_four(const std::uint8_t* at, std::size_t right, std::size_t below) {
  return static_cast<Sample>(
      (sample_at(at) + sample_at(at + right) + sample_at(at + below) + sample_at(at + right + below) + 2) / 4);
}

/// By ITU-R BT.709, as PNG files are read.
template <class Sample, std::uint32_t (*sample_at)(const std::uint8_t*)>
Sample luminance(const std::uint8_t* pixel, std::size_t red, std::size_t green, std::size_t blue) {
  constexpr std::uint32_t kRed = 13933, kGreen = 46871, kBlue = 4732, kAll = kRed + kGreen + kBlue;
  return static_cast<Sample>(
      (kRed * sample_at(pixel + red) + kGreen * sample_at(pixel + green) + kBlue * sample_at(pixel + blue) + kAll / 2) /
      kAll);
}

/// The grey value of every pixel.
template <class Sample, std::uint32_t (*sample_at)(const std::uint8_t*)>
void make_grey(const RosImage& message, const PixelLayout& layout, Sample* to) {
  const std::size_t pixel = sizeof(Sample) * layout.samples;
  const std::size_t red = layout.colour == Colour::rgb ? 0 : 2 * sizeof(Sample), blue = 2 * sizeof(Sample) - red;
  const auto* const data = reinterpret_cast<const std::uint8_t*>(message.data.data()) + sizeof(Sample) * layout.first;
  for (std::uint32_t y = 0; y < message.height; ++y) {
    const std::uint8_t* at = data + std::size_t{y} * message.step;
    const std::size_t below = y + 1 < message.height ? message.step : 0;
    for (std::uint32_t x = 0; x < message.width; ++x, at += pixel)
      *to++ = layout.colour == Colour::grey ? static_cast<Sample>(sample_at(at))
              : layout.colour == Colour::bayer
                  ? mean_of_four<Sample, sample_at>(at, x + 1 < message.width ? pixel : 0, below)
                  : luminance<Sample, sample_at>(at, red, sizeof(Sample), blue);
  }
}

}  // namespace

std::uint32_t picture_bytes(std::string_view encoding) {
  const PixelLayout* const layout = pixel_layout_of(encoding);
  return layout == nullptr ? 0 : layout->samples * (layout->is_deep ? 2 : 1);
}

Status check_rows(const RosImage& message, std::uint32_t pixel_bytes) {
  const std::uint64_t row = std::uint64_t{message.width} * pixel_bytes;
  if (message.width == 0 || message.height == 0 || message.step < row ||
      message.data.size() < (message.height - 1) * std::uint64_t{message.step} + row)
    return fail(ErrorCode::invalid, "{} x {} pixels of {} bytes, rows of {} bytes, {} bytes in all", message.width,
                message.height, pixel_bytes, message.step, message.data.size());
  return {};
}

Result<Image> to_image(const RosImage& message) {
  const PixelLayout* const layout = pixel_layout_of(message.encoding);
  if (layout == nullptr)
    return fail(ErrorCode::unsupported, "encoding '{:.40}', expected {}", message.encoding, kPictures);
  if (auto ok = check_rows(message, picture_bytes(message.encoding)); !ok) return tl::unexpected(ok.error());
  const auto width_px = static_cast<int>(message.width), height_px = static_cast<int>(message.height);
  if (!layout->is_deep) {
    Image out(width_px, height_px);
    make_grey<std::uint8_t, byte_at>(message, *layout, out.grey.data());
    return out;
  }
  std::vector<std::uint16_t> values(std::size_t{message.width} * message.height);
  const auto make = message.is_bigendian ? make_grey<std::uint16_t, big_at> : make_grey<std::uint16_t, little_at>;
  make(message, *layout, values.data());
  return in_8_bits(width_px, height_px, values);
}

}  // namespace tutti::bags
