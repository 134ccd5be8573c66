// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/image_file.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <numeric>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/random.hpp"

namespace tutti::formats {
namespace image_file_test {

const std::string kReal = "data/images/euroc_V1_01_visnav/data/1403715273262142976_0.jpg";

std::string temporary(const std::string& name) { return (std::filesystem::path(testing::TempDir()) / name).string(); }

RC_GTEST_PROP(ImageFile, PngReadsBackBitForBit, ()) {
  Image image(*rc::gen::inRange(1, 40), *rc::gen::inRange(1, 40));
  for (auto& grey : image.grey) grey = *rc::gen::arbitrary<std::uint8_t>();
  const std::string path = temporary("tutti_image.png");
  RC_ASSERT(write_file(path, encode_png(image)).has_value());
  RC_ASSERT(read_image(path).value() == image);

  // Cut anywhere but in what follows the last pixel (a checksum and the chunk IEND): an error that names it.
  const std::string bytes = read_file(path).value();
  const auto cut =
      decode_image(std::string_view(bytes).substr(0, *rc::gen::inRange<std::size_t>(0, bytes.size() - 17)), "cut.png");
  RC_ASSERT(!cut.has_value());
  RC_ASSERT(cut.error().message.starts_with("cut.png: "));
}

TEST(ImageFile, DepthReadsBackWhateverIsReportedOfItsColour) {
  DepthImage all{256, 256, std::vector<std::uint16_t>(std::size_t{1} << 16U)};
  std::iota(all.value.begin(), all.value.end(), std::uint16_t{0});
  const std::string bytes = encode_depth(all);
  EXPECT_EQ(decode_depth(bytes, "depth.png").value(), all);
  const std::string gamma("\0\0\0\4gAMA\0\0\xB1\x8F\x0B\xFC\x61\x05", 16);  // 0.45455, as many programs write
  const std::size_t header = 8 + 25;
  std::string with = bytes;
  ASSERT_EQ(with.compare(header + 4, 4, "gAMA"), 0);  // libpng's own: 1
  EXPECT_EQ(decode_depth(with.replace(header, gamma.size(), gamma), "depth.png").value(), all);
  for (std::size_t left = 0; left < bytes.size() - 17; left += 97)
    EXPECT_FALSE(decode_depth(std::string_view(bytes).substr(0, left), "cut.png")) << left;
  EXPECT_FALSE(decode_depth(encode_png(Image(4, 4)), "grey.png"));
}

TEST(ImageFile, APictureOfSixteenBitsIsStretched) {
  const DepthImage picture{4, 1, {0x100, 0x300, 0x500, 0x200}};
  EXPECT_EQ(decode_image(encode_depth(picture), "a.png").value().grey, (std::vector<std::uint8_t>{0, 128, 255, 64}));
}

TEST(ImageFile, ARealJpegAndWhatIsLeftOfIt) {
  TUTTI_REQUIRE_SHARED(kReal);
  const std::string bytes = read_file(test::shared_path(kReal).string()).value();
  const Image image = decode_image(bytes, "real").value();
  EXPECT_EQ(image.width_px, 752);
  EXPECT_EQ(image.height_px, 480);
  const double mean =
      std::accumulate(image.grey.begin(), image.grey.end(), 0.0) / static_cast<double>(image.grey.size());
  EXPECT_GT(mean, 30.0);
  EXPECT_LT(mean, 200.0);

  for (const double share : {0.0, 0.001, 0.1, 0.5, 0.99}) {
    const auto left = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
    const auto cut = decode_image(std::string_view(bytes).substr(0, left), "cut.jpg");
    ASSERT_FALSE(cut.has_value()) << share;
    EXPECT_TRUE(cut.error().message.starts_with("cut.jpg: ")) << cut.error().message;
  }
}

TEST(ImageFile, DamageIsAnErrorOrAnImage) {
  Rng rng(4);
  Image noise(24, 16);
  for (auto& grey : noise.grey) grey = static_cast<std::uint8_t>(rng.index(256));
  std::vector<std::string> files = {encode_png(noise)};
  if (const auto real = read_file(test::shared_path(kReal).string())) files.push_back(*real);
  for (const std::string& file : files)
    for (int run = 0; run < 60; ++run) {
      std::string bytes = file;
      for (int k = 0; k < 3; ++k)  // half of them in the header
        bytes[rng.index(rng.bernoulli(0.5) ? 600 : bytes.size()) % bytes.size()] = static_cast<char>(rng.index(256));
      const auto image = decode_image(bytes, "damaged");
      if (image) {
        EXPECT_EQ(image->grey.size(),
                  static_cast<std::size_t>(image->width_px) * static_cast<std::size_t>(image->height_px));
      } else {
        EXPECT_TRUE(image.error().message.starts_with("damaged: ")) << image.error().message;
      }
    }
}

TEST(ImageFile, WhatIsNoImageIsNamed) {
  const auto missing = read_image(temporary("not_there.png"));
  ASSERT_FALSE(missing.has_value());
  EXPECT_NE(missing.error().message.find("not_there.png"), std::string::npos);

  const auto text = decode_image("hello", "a.png");
  ASSERT_FALSE(text.has_value());
  EXPECT_EQ(text.error().message, "a.png: neither a PNG nor a JPEG image (5 bytes)");

  // 2^31 - 1 pixels square, by the header: refused before anything is allocated.
  std::string huge("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\0\0\0\0", 29);
  EXPECT_FALSE(decode_image(huge, "huge.png").has_value());
}

TEST(ImageFile, AStreamReadsTheImagesOfAStamp) {
  const auto image = [](int side) { return Image(side, side); };
  std::vector<CameraImages> cameras(2);
  const auto add = [&](std::size_t camera, double time_s, int side) {
    const std::string path = temporary(fmt::format("tutti_stream_{}_{}.png", camera, side));
    ASSERT_TRUE(write_file(path, encode_png(image(side))).has_value());
    cameras[camera].images.push_back({Timestamp{0} + time_s, path});
  };
  for (int i = 1; i <= 4; ++i) add(0, 0.1 * i, i);
  add(1, 0.096, 10);  // the next one is nearer
  add(1, 0.101, 11);  // a millisecond later,
  add(1, 0.299, 13);  // before; and none at the second and fourth stamps
  add(1, 0.450, 14);
  const ImageStream stream = stream_images(cameras);
  ASSERT_EQ(stream.stamps.size(), 4U);
  EXPECT_EQ(stream.cameras.size(), 2U);
  const int expected[] = {11, 0, 13, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(stream.load(i, 0).value(), image(static_cast<int>(i) + 1)) << i;
    EXPECT_EQ(stream.load(i, 1).value(), image(expected[i])) << i;
  }
}

}  // namespace image_file_test
}  // namespace tutti::formats
