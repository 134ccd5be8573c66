// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/image_topic.hpp"

#include <gtest/gtest.h>

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
