// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/picture.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tutti/model/picture_bits.hpp"

namespace tutti::bags {
namespace picture_test {

using Bytes = std::vector<std::uint8_t>;

Result<Image> image(const char* encoding, std::uint32_t width, std::uint32_t height, std::uint32_t step,
                    std::string_view data, bool is_bigendian = false) {
  return to_image({.height = height,
                   .width = width,
                   .encoding = encoding,
                   .is_bigendian = is_bigendian,
                   .step = step,
                   .data = data});
}

Bytes grey(const char* encoding, std::uint32_t width, std::uint32_t height, std::uint32_t step, std::string_view data,
           bool is_bigendian = false) {
  const auto out = image(encoding, width, height, step, data, is_bigendian);
  return out ? out->grey : Bytes{};
}

TEST(BagPicture, ColoursBecomeGrey) {
  const std::string colour("\xff\x00\x00\x00\xff\x00\x00\x00\xff\x07", 10);  // red, green, blue, and padding
  EXPECT_EQ(grey("rgb8", 3, 1, 10, colour), (Bytes{54, 182, 18}));
  EXPECT_EQ(grey("bgr8", 3, 1, 10, colour), (Bytes{18, 182, 54}));
  EXPECT_EQ(grey("mono8", 2, 2, 3, "abxcd"), (Bytes{'a', 'b', 'c', 'd'}));
  EXPECT_EQ(grey("bayer_rggb8", 2, 2, 2, std::string("\x10\x20\x30\x40", 4)), (Bytes{40, 48, 56, 64}));
  EXPECT_FALSE(image("mono8", 2, 2, 3, "abxc"));
  EXPECT_FALSE(image("mono8", 2, 2, 1, "abcd"));
  EXPECT_FALSE(image("mono8", 0xffffffff, 0xffffffff, 0xffffffff, "abcd"));
  EXPECT_NE(image("16UC1", 1, 1, 2, "ab").error().message.find("encoding '16UC1', expected mono8, "),
            std::string::npos);
  EXPECT_EQ(picture_bytes("32FC1"), 0U);
}

TEST(BagPicture, OfYuvTheLumaIsTaken) {
  for (const char* const encoding : {"yuv422", "uyvy"}) EXPECT_EQ(grey(encoding, 2, 1, 4, "uAvB"), (Bytes{'A', 'B'}));
  for (const char* const encoding : {"yuyv", "yuv422_yuy2", "yuy2"})
    EXPECT_EQ(grey(encoding, 2, 2, 5, "AuBvxCuDv"), (Bytes{'A', 'B', 'C', 'D'}));
  for (const char* const encoding : {"nv12", "nv21"})
    EXPECT_EQ(grey(encoding, 2, 2, 2, "ABCDuv"), (Bytes{'A', 'B', 'C', 'D'}));
  EXPECT_FALSE(image("yuyv", 2, 2, 4, "AuBvCuD"));
  EXPECT_FALSE(image("uyvy", 2, 1, 3, "uAv"));
}

TEST(BagPicture, SixteenBitsAreStretched) {
  // A camera of 12 bits: 0x100 to 0x500.
  const std::string little("\x00\x01\x00\x03\x00\x05\x00\x02", 8), big("\x01\x00\x03\x00\x05\x00\x02\x00", 8);
  EXPECT_EQ(grey("mono16", 4, 1, 8, little), (Bytes{0, 128, 255, 64}));
  EXPECT_EQ(grey("mono16", 4, 1, 8, big, true), (Bytes{0, 128, 255, 64}));
  EXPECT_EQ(grey("mono16", 1, 1, 2, little), (Bytes{0}));  // nothing to see in it
  // The means of squares of two by two at the edges: 0x2c0, 0x280, 0x380, 0x200.
  EXPECT_EQ(grey("bayer_rggb16", 2, 2, 4, little), (Bytes{128, 85, 255, 0}));
  const std::string red_and_black("\xff\xff\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00", 12);
  EXPECT_EQ(grey("rgb16", 2, 1, 12, red_and_black), (Bytes{255, 0}));
  EXPECT_FALSE(image("mono16", 4, 1, 7, little));
}

TEST(BagPicture, FewPixelsDoNotDecideHowSixteenBitsAreStretched) {
  std::vector<std::uint16_t> values(4000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint16_t>(7000 + i % 100);
  values[10] = 65535;  // dead pixels of a thermal camera
  values[20] = 0;
  const Image out = in_8_bits(80, 50, values);
  EXPECT_EQ(out.grey[0], 0);
  EXPECT_EQ(out.grey[99], 255);
  EXPECT_EQ(out.grey[10], 255);
  EXPECT_EQ(out.grey[20], 0);
  EXPECT_NEAR(out.grey[50], 129, 1);
}

}  // namespace picture_test
}  // namespace tutti::bags
