// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/depth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace tutti::bags {
namespace depth_test {

using Values = std::vector<std::uint16_t>;

template <class T>
std::string bytes_of(const std::vector<T>& values, bool is_big = false) {
  std::string out(values.size() * sizeof(T), '\0');
  std::memcpy(out.data(), values.data(), out.size());
  if (is_big)
    for (std::size_t i = 0; i < out.size(); i += sizeof(T))
      std::reverse(out.begin() + static_cast<std::ptrdiff_t>(i),
                   out.begin() + static_cast<std::ptrdiff_t>(i + sizeof(T)));
  return out;
}

RosImage image(const char* encoding, std::uint32_t width, std::uint32_t height, std::uint32_t step,
               std::string_view data) {
  return {.height = height, .width = width, .encoding = encoding, .step = step, .data = data};
}

TEST(BagDepth, IsKnownByTheEncoding) {
  for (const char* const encoding : {"16UC1", "32FC1"}) EXPECT_TRUE(is_depth("/camera/image_raw", encoding));
  for (const char* const encoding : {"mono8", "rgb8", "8UC1", "16UC3", "jpeg", "", "mono16"})
    EXPECT_FALSE(is_depth("/camera/image_raw", encoding)) << encoding;
  EXPECT_TRUE(is_depth("/camera/depth/image_raw", "mono16"));
  EXPECT_FALSE(is_depth("/camera/depth/image_raw", "mono8"));  // a picture of it for people
  EXPECT_TRUE(is_depth("/a/compressedDepth", "anything"));
}

TEST(BagDepth, MillimetresStayAndMetresAreTurnedIntoThem) {
  for (const bool is_big : {false, true}) {
    const std::string millimetres = bytes_of<std::uint16_t>({0, 1, 1000, 65535}, is_big);
    RosImage message = image("16UC1", 2, 2, 4, millimetres);
    message.is_bigendian = is_big;
    EXPECT_EQ(to_depth(message)->value, (Values{0, 1, 1000, 65535}));
    message.encoding = "mono16";
    EXPECT_EQ(to_depth(message)->value, (Values{0, 1, 1000, 65535}));
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
    const std::string metres =
        bytes_of<float>({kNan, kInf, -kInf, 0.0F, -1.0F, 1.2344F, 1.2346F, 65.5F, 65.6F, 1e30F}, is_big);
    message = image("32FC1", 5, 2, 20, metres);
    message.is_bigendian = is_big;
    EXPECT_EQ(to_depth(message)->value, (Values{0, 0, 0, 0, 0, 1234, 1235, 65500, 0, 0}));
  }
}

TEST(BagDepth, RowsMayBePaddedAndMayNotLie) {
  const std::string padded = bytes_of<std::uint16_t>({1, 2, 99, 3, 4});
  EXPECT_EQ(to_depth(image("16UC1", 2, 2, 6, padded))->value, (Values{1, 2, 3, 4}));
  EXPECT_EQ(to_depth(image("16UC1", 2, 2, 3, padded)).error().message,
            "2 x 2 pixels of 2 bytes, rows of 3 bytes, 10 bytes in all");
  EXPECT_FALSE(to_depth(image("16UC1", 2, 2, 7, padded)));
  EXPECT_FALSE(to_depth(image("32FC1", 2, 2, 6, padded)));
  EXPECT_FALSE(to_depth(image("16UC1", 0, 2, 6, padded)));
  EXPECT_FALSE(to_depth(image("16UC1", 0xffffffff, 0xffffffff, 0xffffffff, padded)));
  EXPECT_EQ(to_depth(image("8UC1", 2, 2, 2, padded)).error().message,
            "encoding '8UC1', expected 16UC1 or 32FC1 of a depth image");
}

/// As compressed_depth_image_transport writes it: 12 bytes before the PNG image, of float32 its inverse.
TEST(BagDepth, CompressedDepthIsUnpacked) {
  const DepthImage depth{2, 2, {0, 700, 1000, 65535}};
  const std::string png = formats::encode_depth(depth), header(12, '\0');
  const auto message = [](const char* format, const std::string& data) {
    return RosCompressedImage{.header = {{}, "/cam"}, .format = format, .data = data};
  };
  for (const char* const format : {"16UC1; compressedDepth png", "16UC1; compressedDepth", "16UC1;compressedDepth"}) {
    const std::string data = header + png;
    const ImageLayout layout = layout_of(message(format, data));
    EXPECT_EQ(layout.encoding, "16UC1");
    EXPECT_EQ(layout.frame, "cam");
    EXPECT_EQ(layout.width_px, 2U);
    EXPECT_EQ(to_depth(message(format, data), {2, 2}).value(), depth);
    EXPECT_NE(to_depth(message(format, data), {4, 2}).error().message.find("2 x 2 pixels, expected 4 x 2"),
              std::string::npos);
  }
  EXPECT_EQ(to_depth(message("16UC1; png compressed ", png), {}).value(), depth);
  EXPECT_EQ(layout_of(message("png", png)).encoding, "16UC1");  // a picture has 8 bits
  EXPECT_EQ(layout_of(message("png", formats::encode_png(Image(3, 2)))).encoding, "png");
  EXPECT_EQ(layout_of(message("rgb8; jpeg compressed bgr8", "\xFF\xD8")).encoding, "rgb8");
  EXPECT_EQ(layout_of(message("jpeg", "\xFF\xD8")).width_px, 0U);
  EXPECT_EQ(layout_of(message("jpeg", "a broken one")).encoding, "jpeg");
  EXPECT_EQ(layout_of(message("h264", std::string("\0\0\0\1\x67", 5))).encoding, "h264 (neither JPEG nor PNG)");
  EXPECT_EQ(layout_of(message("webp", "RIFF")).encoding, "webp (neither JPEG nor PNG)");
  EXPECT_NE(to_depth(message("16UC1; compressedDepth rvl", header + "rvl bytes"), {})
                .error()
                .message.find("format '16UC1; compressedDepth rvl' with 21 bytes, expected a PNG image"),
            std::string::npos);

  constexpr float kZ0 = 100.0F, kMost = 10.0F, kA = kZ0 * (kZ0 + 1.0F), kB = 1.0F - kA / kMost;
  DepthImage inverse{3, 1, {}};
  for (const float z : {0.5F, 3.0F, 9.9F}) inverse.value.push_back(static_cast<std::uint16_t>(kA / z + kB));
  inverse.value[1] = 0;
  const std::string data = std::string(4, '\0') + bytes_of<float>({kA, kB}) + formats::encode_depth(inverse);
  const DepthImage back = to_depth(message("32FC1; compressedDepth png", data), {3, 1}).value();
  EXPECT_NEAR(back.value[0], 500, 1);
  EXPECT_EQ(back.value[1], 0);
  EXPECT_NEAR(back.value[2], 9900, 11);
  EXPECT_FALSE(to_depth(message("32FC1; png compressed", formats::encode_depth(inverse)), {}));  // no numbers before it
  const std::string nonsense = std::string(4, '\0') +
                               bytes_of<float>({std::numeric_limits<float>::quiet_NaN(), 1e38F}) +
                               formats::encode_depth(inverse);
  EXPECT_EQ(to_depth(message("32FC1; compressedDepth", nonsense), {3, 1})->value, (Values{0, 0, 0}));
}

TEST(BagDepth, WhatIsOtherThanInTheFirstMessageIsReported) {
  const ImageLayout first{"16UC1", "cam", 4, 3};
  const auto why = [&](const ImageLayout& layout) {
    const Status ok = check_like_first(layout, first);
    return ok ? "" : ok.error().message;
  };
  EXPECT_EQ(why(first), "");
  EXPECT_EQ(why({"32FC1", "cam", 4, 3}), "encoding '32FC1', expected '16UC1' as of the first");
  EXPECT_EQ(why({"16UC1", "other", 4, 3}), "frame 'other', expected 'cam' as of the first");
  EXPECT_EQ(why({"16UC1", "cam", 8, 3}), "8 x 3 pixels, expected 4 x 3 as of the first");
}

TEST(BagDepth, BytesOfStrangersDoNoHarm) {
  const std::string png = formats::encode_depth({4, 3, Values(12, 700)});
  std::mt19937 rng(1);
  for (int i = 0; i < 5'000; ++i) {
    std::string bytes = (rng() % 2 == 0 ? std::string(12, '\1') : "") + png;
    for (std::size_t k = rng() % 4; k > 0; --k) bytes[rng() % bytes.size()] = static_cast<char>(rng());
    if (rng() % 2 == 0) bytes.resize(rng() % bytes.size());
    const RosCompressedImage message{.header = {}, .format = rng() % 2 == 0 ? "32FC1;" : "16UC1;", .data = bytes};
    static_cast<void>(layout_of(message));
    const auto depth = to_depth(message, {4, 3});
    if (depth) {
      EXPECT_EQ(depth->value.size(), 12U);
    }
  }
}

}  // namespace depth_test
}  // namespace tutti::bags
