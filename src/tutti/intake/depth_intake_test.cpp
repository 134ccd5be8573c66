// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/intake/camera_robot.hpp"
#include "tutti/formats/image_file.hpp"

namespace tutti::intake {
namespace depth_intake_test {

using namespace test;

/// A robot with one camera and topics of depth, all calibrated alike.
struct DepthRobot : CameraRobot {
  explicit DepthRobot(std::vector<CameraTopics> topics = {kLeft, kDepth}, ImagesConfig config = {})
      : CameraRobot(topics, "", std::move(config)) {
    place();
    go(0);
    for (std::size_t i = 0; i < topics.size(); ++i) EXPECT_TRUE(images.add_info(i, bags::encode(calibration())));
  }
  std::string add(std::size_t topic, const bags::RosImage& image) {
    return why(images.add_image(topic, bags::encode(image)));
  }
};

TEST(DepthIntake, DepthIsNeverACameraAndIsFedBesideIt) {
  DepthRobot robot({kDepth, kLeft});
  EXPECT_EQ(robot.add(0, depth_image(kStart)), "");
  EXPECT_TRUE(robot.sensors().cameras.empty());  // the other has sent nothing
  EXPECT_EQ(robot.add(1, grey_image(kStart)), "");
  const Sensors sensors = robot.sensors();
  ASSERT_EQ(sensors.cameras.size(), 1U);
  ASSERT_TRUE(sensors.depth);
  EXPECT_EQ(sensors.depth->unit_m, 0.001);
  EXPECT_TRUE(check_sensors(sensors));
  EXPECT_EQ(robot.images.in_words(), "/r/left/image_raw with depth of /r/depth/image_raw");
  const auto images = robot.images.next_images({kStart}).value();
  ASSERT_TRUE(images && images->depth);
  EXPECT_EQ(images->depth->bytes, depth_image(kStart).data);
  EXPECT_TRUE(check_images(*images, sensors));
}

TEST(DepthIntake, DepthInMetresAndCompressedDepthAreTheSame) {
  std::vector<float> metres(12, 1.28F);
  metres[3] = NAN;
  DepthRobot raw;
  bags::RosImage image = depth_image(kStart);
  image.encoding = "32FC1";
  image.step = 16;
  image.data = {reinterpret_cast<const char*>(metres.data()), metres.size() * sizeof(float)};
  EXPECT_EQ(raw.add(1, image), "");
  EXPECT_EQ(raw.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(raw.sensors().depth);
  std::string expected(depth_image(kStart).data);
  expected[7] = 0;
  EXPECT_EQ(raw.images.next_images({kStart}).value()->depth->bytes, expected);

  CameraTopics compressed{.images = "/r/depth/compressedDepth", .info = "/r/camera_info", .is_compressed = true};
  DepthRobot packed({kLeft, compressed});
  const std::string png = formats::encode_depth({4, 3, std::vector<std::uint16_t>(12, 1280)});
  const std::string file = std::string(12, '\0') + png;
  const bags::RosCompressedImage message{
      .header = {{kStart}, "camera"}, .format = "16UC1; compressedDepth png", .data = file};
  EXPECT_EQ(why(packed.images.add_image(1, bags::encode(message))), "");
  EXPECT_EQ(packed.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(packed.sensors().depth);
  const auto fed = packed.images.next_images({kStart}).value();
  EXPECT_EQ(fed->depth->bytes, png);
  EXPECT_FALSE(fed->depth->is_raw);
}

/// The nearest within 0.02 s, of another rate, one depth image for two images, and none once it has ended.
TEST(DepthIntake, EveryImageHasTheNearestDepth) {
  DepthRobot robot;
  constexpr std::int64_t kMs = 1'000'000;
  const auto see = [&](std::int64_t ms) { EXPECT_EQ(robot.add(0, grey_image(kStart + ms * kMs)), ""); };
  const auto measure = [&](std::int64_t ms, char mark) {
    bags::RosImage image = depth_image(kStart + ms * kMs);
    std::string bytes(image.data);
    bytes[0] = mark;
    image.data = bytes;
    EXPECT_EQ(robot.add(1, image), "");
  };
  const auto next = [&](int sample) -> std::string {
    const auto images = robot.images.next_images(robot.go(sample)).value();
    if (!images) return "waits";
    return images->depth ? images->depth->bytes.substr(0, 1) : "none";
  };
  see(0);
  measure(-15, 'a');
  EXPECT_TRUE(robot.sensors().depth);
  EXPECT_EQ(next(0), "waits");  // a nearer one may come
  measure(10, 'b');
  EXPECT_EQ(next(0), "b");
  see(25);
  measure(60, 'c');
  EXPECT_EQ(next(1), "b");
  see(90);
  EXPECT_EQ(next(1), "waits");
  measure(111, 'd');
  EXPECT_EQ(next(1), "none");
  see(200);  // depth has ended
  EXPECT_EQ(next(4), "waits");
  EXPECT_EQ(next(5), "none");
  see(5'200);
  EXPECT_EQ(
      robot.images.missing(),
      fmt::format("/r/depth/image_raw has ended, or is by another clock: its newest is of {} ns", kStart + 111 * kMs));
}

TEST(DepthIntake, WhichDepthIsUsedIsReported) {
  const CameraTopics second = topics_of("/r/confidence");
  DepthRobot several({kLeft, kDepth, second});
  for (const std::size_t topic : {1U, 2U}) EXPECT_EQ(several.add(topic, depth_image(kStart)), "");
  EXPECT_EQ(several.add(0, grey_image(kStart)), "");
  EXPECT_FALSE(several.sensors().depth);
  expect(several.images.note(), "say which: --depth /r/depth/image_raw");
  EXPECT_FALSE(several.images.uses(1));
  EXPECT_FALSE(several.images.next_images({kStart}).value()->depth);

  DepthRobot named({kLeft, topics_of("/r/depth", Wish::depth), second}, {.depth = "/r/depth/image_raw"});
  for (const std::size_t topic : {1U, 2U}) EXPECT_EQ(named.add(topic, depth_image(kStart)), "");
  EXPECT_EQ(named.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(named.sensors().depth);
  EXPECT_EQ(named.images.note(), "");

  DepthRobot wrong({topics_of("/r/left", Wish::depth)}, {.depth = "/r/left/image_raw"});
  EXPECT_EQ(wrong.add(0, grey_image(kStart)), "");
  EXPECT_EQ(wrong.sensors().cameras.size(), 1U);
  EXPECT_EQ(wrong.images.note(),
            "no depth is used: /r/left/image_raw shows none, expected an encoding of 16UC1 or 32FC1");

  DepthRobot unwanted({kLeft, kDepth}, {.with_depth = false});
  EXPECT_EQ(unwanted.add(1, depth_image(kStart)), "");
  EXPECT_EQ(unwanted.add(0, grey_image(kStart)), "");
  EXPECT_EQ(unwanted.sensors().cameras.size(), 1U);
  EXPECT_FALSE(unwanted.sensors().depth);
  EXPECT_EQ(unwanted.images.note(), "");

  DepthRobot elsewhere;  // its frame has no transform: it may come, until it is late
  EXPECT_EQ(elsewhere.add(1, depth_image(kStart, "depth_optical")), "");
  EXPECT_EQ(elsewhere.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(elsewhere.sensors().cameras.empty());
  EXPECT_EQ(elsewhere.sensors(true).cameras.size(), 1U);
  expect(elsewhere.images.note(),
         "/r/depth/image_raw: frame 'depth_optical', expected 'camera' as of /r/left/image_raw");
}

TEST(DepthIntake, ATopicThatSendsNothingIsLeftOutOnceLate) {
  DepthRobot robot({kLeft, kRight, kDepth});
  EXPECT_EQ(robot.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(robot.sensors().cameras.empty());
  expect(robot.images.missing(), "/r/right/image_raw: no image");
  EXPECT_EQ(robot.sensors(true).cameras.size(), 1U);
  EXPECT_FALSE(robot.images.uses(1));
  DepthRobot named({topics_of("/r/left", Wish::camera), topics_of("/r/right", Wish::camera)},
                   {.images = {"/r/left/image_raw", "/r/right/image_raw"}});
  EXPECT_EQ(named.add(0, grey_image(kStart)), "");
  EXPECT_TRUE(named.sensors(true).cameras.empty());
  DepthRobot depths({kDepth});
  EXPECT_EQ(depths.add(0, depth_image(kStart)), "");
  EXPECT_TRUE(depths.sensors(true).cameras.empty());
  expect(depths.images.missing(),
         "no images are used: none of the topics with a CameraInfo shows pictures: /r/depth/image_raw");
}

TEST(DepthIntake, CamerasThatCannotBeChosenAreReported) {
  const auto problem = [](std::vector<CameraTopics> topics, ImagesConfig config, std::size_t depths) {
    DepthRobot robot(topics, std::move(config));
    for (std::size_t i = 0; i < topics.size(); ++i)
      EXPECT_EQ(robot.add(i, i < depths ? depth_image(kStart) : grey_image(kStart)), "");
    const auto chosen = robot.images.choose(false);
    return chosen ? "" : chosen.error().message;
  };
  expect(problem({kLeft, kRight, topics_of("/r/up")}, {}, 0),
         "3 cameras, expected one or two; say which: --images /r/left/image_raw,/r/right/image_raw,/r/up/image_raw");
  expect(problem({topics_of("/r/depth", Wish::camera)}, {.images = {"/r/depth/image_raw"}}, 1),
         "/r/depth/image_raw: encoding '16UC1' is no picture, but depth (a camera's own 16 bits are mono16): --depth");
  CameraTopics same = kLeft;
  same.images = "/r/left/image_rect";
  expect(problem({kLeft, same}, {}, 0), "/r/left/image_rect shows what /r/left/camera_info calibrates, and another");
  expect(problem({kLeft, kRight, kDepth, topics_of("/r/depth2")}, {}, 0), "4 cameras, expected one or two");
}

TEST(DepthIntake, WrongDepthIsReportedAndLeftOut) {
  DepthRobot robot;
  bags::RosImage image = depth_image(kStart);
  image.step = 7;
  expect(robot.add(1, image), "depth at 1700000000000000000 ns: 4 x 3 pixels of 2 bytes, rows of 7 bytes, 24 bytes");
  EXPECT_EQ(robot.add(1, depth_image(kStart)), "");
  expect(robot.add(1, depth_image(kStart)), "two publishers, or a clock that began anew?");
  expect(robot.add(1, depth_image(kStart + 1, "other")), "frame 'other', expected 'camera' as of the first");
  image = depth_image(kStart + 2);
  image.width = 2;
  expect(robot.add(1, image), "2 x 3 pixels, expected 4 x 3 as of the first");
  expect(robot.add(1, grey_image(kStart + 3)), "encoding 'mono8', expected '16UC1' as of the first");
  image = depth_image(kStart + 4);
  image.is_bigendian = true;
  EXPECT_EQ(robot.add(1, image), "");
  EXPECT_EQ(robot.add(0, grey_image(kStart + 4)), "");
  EXPECT_TRUE(robot.sensors().depth);
  EXPECT_EQ(robot.images.next_images(robot.go(1)).value()->depth->bytes.substr(0, 2), std::string("\5\0", 2));
}

}  // namespace depth_intake_test
}  // namespace tutti::intake
