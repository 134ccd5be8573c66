// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/image_topic.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tutti::bags {
namespace image_topic_test {

ImageTopic topic(const char* name, const char* encoding, bool is_compressed = false) {
  return {name, is_compressed, ImageLayout{encoding, "camera", 640, 480}, {}};
}

TEST(ImageTopic, ShowsWhatItsFirstMessageDoes) {
  const ImageTopic unseen{"/image"};
  EXPECT_FALSE(unseen.shows_picture());
  EXPECT_FALSE(unseen.shows_depth());
  EXPECT_EQ(unseen.check_picture().error().message, "/image: no images");
  EXPECT_TRUE(topic("/image", "bgr8").check_picture().has_value());
  EXPECT_TRUE(topic("/image/compressed", "jpeg", true).check_picture().has_value());
  EXPECT_TRUE(topic("/depth", "16UC1").shows_depth());
  EXPECT_EQ(topic("/depth", "16UC1").check_picture().error().message,
            "/depth: encoding '16UC1' is no picture, but depth (a camera's own 16 bits are mono16)");
  EXPECT_EQ(
      topic("/flow", "32FC2").check_picture().error().message,
      "/flow: encoding '32FC2' is no picture that is read, expected mono8, rgb8, bgr8, rgba8, bgra8 or bayer_..8, "
      "the same of 16 bits, yuv422 (uyvy), yuyv (yuv422_yuy2) or nv12");
  EXPECT_TRUE(topic("/thermal", "mono16").check_picture().has_value());
  EXPECT_FALSE(topic("/depth/image", "mono16").shows_picture());
  EXPECT_EQ(topic("/video", "h264 (neither JPEG nor PNG)", true).check_picture().error().message,
            "/video: encoding 'h264 (neither JPEG nor PNG)' is no picture that is read, expected JPEG or PNG");
}

std::string why(const Status& status) { return status ? "" : status.error().message; }

TEST(ImageTopic, MessagesOfWhichNoImageCanBeMadeAreRefused) {
  const std::string bytes(32, 'x');
  const auto image = [&](const char* encoding, std::uint32_t width, std::size_t size, const char* frame = "camera") {
    RosImage out{.header = {{5}, frame}, .height = 4, .width = width};
    out.encoding = encoding;
    out.step = 8;
    out.data = std::string_view(bytes).substr(0, size);
    return out;
  };
  ImageTopic camera{"/image"};
  EXPECT_EQ(why(camera.add(image("mono8", 8, 31))), "8 x 4 pixels of 1 bytes, rows of 8 bytes, 31 bytes in all");
  EXPECT_TRUE(camera.shows_picture());  // but which comes first is not known yet
  EXPECT_EQ(why(camera.add(image("mono16", 4, 32))), "");
  EXPECT_EQ(camera.first->encoding, "mono16");
  EXPECT_EQ(why(camera.add(image("mono8", 8, 32, "other"))), "");
  EXPECT_EQ(camera.first->encoding, "mono16");

  ImageTopic depth{"/depth"};
  EXPECT_EQ(why(depth.add(image("16UC1", 5, 32))), "5 x 4 pixels of 2 bytes, rows of 8 bytes, 32 bytes in all");
  EXPECT_EQ(why(depth.add(image("16UC1", 4, 32))), "");
  EXPECT_EQ(why(depth.add(image("16UC1", 3, 32))), "3 x 4 pixels, expected 4 x 4 as of the first");
  EXPECT_EQ(why(depth.add(image("mono8", 4, 32))), "encoding 'mono8', expected '16UC1' as of the first");
  EXPECT_EQ(why(depth.add(image("16UC1", 4, 32, "other"))), "frame 'other', expected 'camera' as of the first");

  ImageTopic files{"/image/compressed", true}, packed{"/depth/compressedDepth", true};
  RosCompressedImage file{.header = {{5}, "camera"}, .format = "jpeg", .data = {}};
  EXPECT_EQ(why(files.add(file)), "an image of no bytes, expected a PNG or JPEG file");
  file.data = "\xff\xd8";
  EXPECT_EQ(why(files.add(file)), "");
  EXPECT_EQ(why(packed.add(file)), "format 'jpeg', expected a PNG image as compressedDepth has");
}

TEST(ImageTopic, ACameraIsCalibratedBesideItsPictures) {
  EXPECT_EQ(topic("/flow", "32FC2").camera().error().message, topic("/flow", "32FC2").check_picture().error().message);
  ImageTopic seen = topic("/image", "mono8");
  EXPECT_EQ(seen.camera().error().message, "/image: no sensor_msgs/CameraInfo beside it, expected on /camera_info");
  seen.info = RosCameraInfo{.height = 480, .width = 640};
  EXPECT_NE(seen.camera().error().message.find("/image: is the camera calibrated?"), std::string::npos);
  seen.info->k = {500, 0, 320, 0, 500, 240, 0, 0, 1};
  EXPECT_TRUE(seen.camera().has_value());
}

TEST(ImageTopic, OfPicturesTheCalibrationsSizeCounts) {
  RosCameraInfo info;
  info.width = 1280;
  info.height = 720;
  for (const char* encoding : {"mono8", "16UC1"}) {
    ImageTopic seen = topic("/depth", encoding);
    EXPECT_EQ(seen.width_px(), 640U);
    seen.info = info;
    EXPECT_EQ(seen.width_px(), seen.shows_depth() ? 640U : 1280U) << encoding;
    EXPECT_EQ(seen.height_px(), seen.shows_depth() ? 480U : 720U) << encoding;
  }
}

}  // namespace image_topic_test
}  // namespace tutti::bags
