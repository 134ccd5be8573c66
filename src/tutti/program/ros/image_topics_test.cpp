// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/image_topics.hpp"

#include <gtest/gtest.h>

#include "support/intake/camera_robot.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::ros {
namespace image_topics_test {

using namespace intake::test;

std::vector<Publication> publications(const std::vector<std::pair<const char*, const char*>>& all) {
  std::vector<Publication> out;
  for (const auto& [topic, type] : all) out.push_back({.topic = topic, .type = type, .user_data = {}});
  return out;
}
std::vector<std::string> names(const Result<std::vector<intake::CameraTopics>>& topics) {
  std::vector<std::string> out;
  for (const intake::CameraTopics& topic : topics.value()) out.push_back(topic.images);
  return out;
}

TEST(ImageTopics, TopicsAreFoundByType) {
  intake::ImagesConfig config;
  ASSERT_TRUE(resolve(config, "r"));
  auto published = publications({{"/r/right/image_raw", bags::kImageType},
                                 {"/r/right/camera_info", bags::kCameraInfoType},
                                 {"/r/left/image_raw", bags::kImageType},
                                 {"/r/left/image_raw/compressed", bags::kCompressedType},
                                 {"/r/left/image_raw/compressedDepth", bags::kCompressedType},
                                 {"/r/left/camera_info", bags::kCameraInfoType},
                                 {"/r/rviz", bags::kImageType},
                                 {"/s/image_raw", bags::kImageType},
                                 {"/s/camera_info", bags::kCameraInfoType},
                                 {"/s/imu", bags::kImuType},
                                 {"/r/imu", bags::kImuType}});
  EXPECT_EQ(find_images(published, config).value(), (std::vector{kLeft, kRight}));
  EXPECT_EQ(choose_imu(published, config).value(), "/r/imu");
  EXPECT_TRUE(find_images(publications({}), config)->empty());
  published.push_back({.topic = "/r/imu2", .type = bags::kImuType, .user_data = {}});
  expect(choose_imu(published, config).error().message, "2 topics have one; say which: --imu /r/imu ");

  intake::ImagesConfig named{.images = {"left/image_raw/compressed"}, .with_depth = false, .imu = "imu2"};
  ASSERT_TRUE(resolve(named, "r"));
  EXPECT_EQ(names(find_images(published, named)), std::vector<std::string>{"/r/left/image_raw/compressed"});
  EXPECT_EQ(choose_imu(published, named).value(), "/r/imu2");
  named.images.push_back("/r/left/image_raw");
  expect(find_images(published, named).error().message, "several of one CameraInfo, /r/left/camera_info");
  named.images.back() = "/r/none";
  EXPECT_TRUE(find_images(published, named)->empty());
  EXPECT_FALSE(resolve(named, "a b"));
}

/// One camera that is named may have depth that is not; what both are named nothing else is looked at.
TEST(ImageTopics, DepthIsFoundAmongTheOthersOrNamed) {
  const auto published = publications({{"/r/color/image_raw", bags::kImageType},
                                       {"/r/color/camera_info", bags::kCameraInfoType},
                                       {"/r/depth/image_raw", bags::kImageType},
                                       {"/r/depth/camera_info", bags::kCameraInfoType},
                                       {"/r/registered", bags::kImageType}});
  const std::vector<std::string> both{"/r/color/image_raw", "/r/depth/image_raw"};
  intake::ImagesConfig config{.images = {"color/image_raw"}};
  ASSERT_TRUE(resolve(config, "r"));
  EXPECT_EQ(names(find_images(published, config)), both);
  EXPECT_EQ(find_images(published, config)->front().wish, intake::Wish::camera);
  config.depth = "/r/registered";
  const auto named = find_images(published, config).value();
  EXPECT_EQ(names(named), (std::vector<std::string>{"/r/color/image_raw", "/r/registered"}));
  EXPECT_EQ(named.back().wish, intake::Wish::depth);
  EXPECT_FALSE(named.back().has_info);
  config.depth = "/r/none";
  EXPECT_TRUE(find_images(published, config)->empty());
  config.depth = {};
  config.with_depth = false;
  EXPECT_EQ(names(find_images(published, config)), std::vector<std::string>{"/r/color/image_raw"});
  config.images = {};
  EXPECT_EQ(names(find_images(published, config)), both);  // their messages show which is the camera
}

}  // namespace image_topics_test
}  // namespace tutti::ros
