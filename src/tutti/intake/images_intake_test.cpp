// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/images_intake.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/intake/camera_robot.hpp"

namespace tutti::intake {
namespace images_intake_test {

using namespace test;
using Robot = CameraRobot;

TEST(ImagesIntake, CamerasAndImuAreKnownOnceCalibrationAndPlaceAre) {
  Robot robot;
  expect(robot.images.missing(), "no images are used: /r/left/camera_info: no sensor_msgs/CameraInfo");
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  expect(robot.images.missing(), "/r/left/image_raw: no image");
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart))));
  expect(robot.images.missing(), "no odometry has shown yet which frame is the body");
  robot.go(0);
  ASSERT_TRUE(robot.images.add_imu(imu(kStart)));
  expect(robot.images.missing(), "no transform from 'camera' to 'base_link' on /tf_static");
  EXPECT_TRUE(robot.sensors().cameras.empty());
  EXPECT_FALSE(robot.sensors().imu);
  robot.place();
  EXPECT_EQ(robot.images.missing(), "");
  const Sensors sensors = robot.sensors();
  ASSERT_EQ(sensors.cameras.size(), 1U);
  EXPECT_EQ(sensors.cameras[0].T_body_camera, kBodyCamera);
  EXPECT_EQ(sensors.cameras[0].model.fx, 3.0);
  EXPECT_EQ(sensors.imu, ImuNoise{});
  EXPECT_TRUE(check_sensors(sensors));
}

TEST(ImagesIntake, ImagesAndSamplesAreFedWhenOdometryCoversThem) {
  Robot robot({kLeft}, "/r/imu", {.time_offset_s = 0.05});
  robot.place();
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  robot.go(0);
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart - kPeriod))));  // before all odometry
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart))));            // at 0.05 s
  for (int i = 0; i <= 70; ++i) ASSERT_TRUE(robot.images.add_imu(imu(kStart + i * kPeriod / 10)));
  EXPECT_EQ(robot.sensors().cameras.size(), 1U);
  EXPECT_TRUE(robot.images.reaches({kStart}));
  EXPECT_FALSE(robot.images.reaches({kStart + kPeriod}));
  EXPECT_FALSE(robot.images.next_images({kStart}).value());
  EXPECT_EQ(robot.images.next_imu({kStart}).size(), 51U);  // half a second ahead
  EXPECT_TRUE(robot.images.next_imu({kStart}).empty());
  const std::vector<ImuSample> rest = robot.images.next_imu(robot.go(2));
  ASSERT_EQ(rest.size(), 20U);
  EXPECT_LT((rest[0].gyro - Eigen::Vector3d(-2, 1, 3)).norm(), 1e-12);
  const auto images = robot.images.next_images(robot.go(2)).value();
  ASSERT_TRUE(images);
  EXPECT_EQ(images->stamp.ns, kStart + kPeriod / 2);
  ASSERT_EQ(images->images.size(), 1U);
  EXPECT_TRUE(images->images[0].is_raw);
  EXPECT_EQ(images->images[0].bytes, "abcdefghijkl");
  EXPECT_TRUE(check_images(*images, robot.sensors()));
  EXPECT_FALSE(robot.images.next_images(robot.go(2)).value());
}

TEST(ImagesIntake, TwoCamerasAreFedTogetherOrTheFirstAlone) {
  Robot robot({kLeft, kRight}, "");
  robot.place();
  const auto add = [&](std::size_t camera, std::int64_t ns) {
    ASSERT_TRUE(robot.images.add_image(camera, bags::encode(grey_image(ns))));
  };
  robot.go(0);
  for (std::size_t camera : {0U, 1U}) ASSERT_TRUE(robot.images.add_info(camera, bags::encode(calibration())));
  add(1, kStart - kPeriod / 2);
  EXPECT_TRUE(robot.sensors().cameras.empty());  // the first has sent nothing
  add(0, kStart);
  EXPECT_EQ(robot.sensors().cameras.size(), 2U);
  EXPECT_FALSE(robot.images.next_images({kStart}).value());  // the second's may come
  add(1, kStart + 1'000'000);
  const auto both = robot.images.next_images({kStart}).value();
  ASSERT_TRUE(both);
  ASSERT_EQ(both->images.size(), 2U);
  EXPECT_EQ(both->images[1].camera, 1U);
  add(0, kStart + kPeriod);
  add(1, kStart + 2 * kPeriod);  // the second's of that time is lost
  EXPECT_EQ(robot.images.next_images(robot.go(1)).value()->images.size(), 1U);
  add(0, kStart + 2 * kPeriod);
  EXPECT_EQ(robot.images.next_images(robot.go(2)).value()->images.size(), 2U);
  add(0, kStart + 3 * kPeriod);
  EXPECT_FALSE(robot.images.next_images(robot.go(5)).value());
  EXPECT_EQ(robot.images.next_images(robot.go(6)).value()->images.size(), 1U);  // the second has ended

  const std::int64_t instant = kStart + 7 * kPeriod;
  add(0, instant);
  add(1, instant - 3'000'000);
  EXPECT_FALSE(robot.images.next_images(robot.go(7)).value());  // a nearer one may come
  bags::RosImage image = grey_image(instant + 1'000'000);
  image.data = "ABCDEFGHIJKL";
  ASSERT_TRUE(robot.images.add_image(1, bags::encode(image)));
  add(1, instant + 4'000'000);
  const auto nearest = robot.images.next_images(robot.go(7)).value();
  ASSERT_TRUE(nearest && nearest->images.size() == 2U);
  EXPECT_EQ(nearest->images[1].bytes, "ABCDEFGHIJKL");
}

TEST(ImagesIntake, FilesStayAsTheyAre) {
  Robot robot({{.images = "/r/image_raw/compressed", .info = "/r/camera_info", .is_compressed = true}}, "");
  robot.place();
  robot.go(0);
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  const bags::RosCompressedImage jpeg{.header = {{kStart}, "camera"}, .format = "jpeg", .data = "any bytes"};
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(jpeg)));
  EXPECT_EQ(robot.sensors().cameras.size(), 1U);
  const auto images = robot.images.next_images({kStart}).value();
  EXPECT_FALSE(images->images[0].is_raw);
  EXPECT_EQ(images->images[0].bytes, "any bytes");
}

TEST(ImagesIntake, WhatIsWrongIsReported) {
  Robot robot;
  robot.place();
  robot.go(0);
  const auto add = [&](const bags::RosImage& image) { return why(robot.images.add_image(0, bags::encode(image))); };
  bags::RosImage image = grey_image(kStart);
  image.step = 3;
  expect(add(image), "4 x 3 pixels of 1 bytes, rows of 3 bytes");
  image.step = 4;
  image.data.remove_suffix(1);
  expect(add(image), "11 bytes in all");
  expect(why(robot.images.add_image(0, odometry(kStart))), "sensor_msgs/msg/Image: ");
  expect(add(grey_image(0)), "does not fill header.stamp");
  expect(add(grey_image(kStart - 20'000'000'000)), "are they by another clock?");
  EXPECT_EQ(add(grey_image(kStart)), "");
  expect(add(grey_image(kStart)), "two publishers, or a clock that began anew?");
  image.encoding = "16UC1";  // though its first was a picture
  expect(add(image), "encoding '16UC1', expected mono8, ");
  bags::RosCameraInfo none = calibration();
  none.k = {};
  expect(why(robot.images.add_info(0, bags::encode(none))), "is the camera calibrated?");
  expect(why(robot.images.add_info(0, bags::encode(calibration(8, 6)))),
         "an image of 4 x 3 pixels, expected 8 x 6 as /r/left/camera_info says");
  expect(add(grey_image(kStart + 1)), "expected 8 x 6");
  EXPECT_FALSE(robot.images.next_images({kStart + 1}).value());
  expect(why(robot.images.add_imu(imu(kStart, {0, NAN, 0}))), "not all numbers are finite");
  EXPECT_EQ(why(robot.images.add_imu(imu(kStart))), "");
  expect(why(robot.images.add_imu(imu(kStart - 1))), "expected after 1700000000000000000 ns");
  EXPECT_EQ(robot.images.missing(), "");
}

TEST(ImagesIntake, AnImuElsewhereIsReported) {
  Robot robot;
  robot.go(0);
  ASSERT_TRUE(robot.odometry_.add_tf(transform(0, "base_link", "imu", kBodyCamera), true));
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart, "base_link"))));
  ASSERT_TRUE(robot.images.add_imu(imu(kStart)));
  EXPECT_EQ(robot.images.missing(), "no IMU is used: /r/imu: is 0.374 m from the body's origin, expected 0");
  EXPECT_EQ(robot.sensors().cameras.size(), 1U);
  EXPECT_FALSE(robot.sensors().imu);
}

TEST(ImagesIntake, WhatWaitsHasAnEnd) {
  Robot robot({{.images = "/r/image_raw/compressed", .info = "/r/camera_info", .is_compressed = true}});
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  const std::string file = "\xff\xd8\xff" + std::string(ImagesIntake::kMostBytes / 10 - 3, 'x');  // as JPEG begins
  for (int i = 0; i < 30; ++i)
    ASSERT_TRUE(robot.images.add_image(
        0, bags::encode(bags::RosCompressedImage{.header = {{kStart + i}, "base_link"}, .format = {}, .data = file})));
  for (std::size_t i = 0; i < 2 * ImagesIntake::kMostSamples; ++i)
    ASSERT_TRUE(robot.images.add_imu(imu(kStart + static_cast<std::int64_t>(i), {0, 0, 0}, "base_link")));
  robot.go(0);
  EXPECT_EQ(robot.sensors().cameras.size(), 1U);
  std::size_t images = 0, samples = 0;
  while (robot.images.next_images({kStart + kPeriod}).value()) ++images;
  for (std::size_t some = 1; some > 0; samples += some) some = robot.images.next_imu({kStart}).size();
  EXPECT_EQ(images, 10U);
  EXPECT_EQ(samples, ImagesIntake::kMostSamples);
}

/// Any byte of any message may be wrong, and any message cut.
TEST(ImagesIntake, BytesOfStrangersDoNoHarm) {
  Robot robot({kLeft, kDepth});
  robot.place();
  robot.go(0);
  std::mt19937 rng(1);
  const std::vector<std::string> good{bags::encode(grey_image(kStart)), bags::encode(depth_image(kStart)),
                                      bags::encode(calibration()), imu(kStart)};
  std::size_t refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = good[rng() % good.size()];
    for (std::size_t k = 1 + rng() % 3; k > 0; --k) bytes[rng() % bytes.size()] = static_cast<char>(rng());
    if (rng() % 3 == 0) bytes.resize(rng() % bytes.size());
    const std::size_t kind = rng() % 3;
    const std::size_t topic = rng() % 2;
    const Status taken = kind == 0   ? robot.images.add_image(topic, bytes)
                         : kind == 1 ? robot.images.add_info(topic, bytes)
                                     : robot.images.add_imu(bytes);
    refused += taken ? 0 : 1;
    static_cast<void>(robot.images.choose(i > 10'000));
    static_cast<void>(robot.images.next_images({kStart}));
    static_cast<void>(robot.images.next_imu({kStart}));
  }
  EXPECT_GT(refused, 15'000U);
}

}  // namespace images_intake_test
}  // namespace tutti::intake
