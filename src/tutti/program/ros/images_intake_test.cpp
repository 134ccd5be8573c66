// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/images_intake.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/program/ros/messages.hpp"

namespace tutti::ros {
namespace images_intake_test {

using test::calibration, test::grey_image, test::imu, test::kPeriod, test::kSecond, test::kStart, test::odometry,
    test::transform;

std::string why(const Status& status) { return status ? "" : status.error().message; }
void expect(const std::string& said, const std::string& part) { EXPECT_NE(said.find(part), std::string::npos) << said; }

const CameraTopics kLeft{"/r/left/image_raw", "/r/left/camera_info", false},
    kRight{"/r/right/image_raw", "/r/right/camera_info", false};
const Pose3 kBodyCamera{Eigen::Quaterniond::Identity(), {0.1, 0.2, 0.3}};
const Pose3 kBodyImu{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 0, 0}};

/// A robot whose odometry runs at 10 Hz, and its cameras.
struct Robot {
  explicit Robot(std::vector<CameraTopics> cameras = {kLeft}, const std::string& imu_topic = "/r/imu",
                 ImagesConfig config = {})
      : images(std::move(config), std::move(cameras), imu_topic, odometry_) {}
  void place() {
    EXPECT_TRUE(odometry_.add_tf(transform(0, "base_link", "camera", kBodyCamera), true));
    EXPECT_TRUE(odometry_.add_tf(transform(0, "base_link", "imu", kBodyImu), true));
  }
  /// Feeds odometry up to and including sample `i`.
  Timestamp go(int i) {
    for (; next_ <= i; ++next_) {
      EXPECT_TRUE(odometry_.add_odometry(odometry(kStart + next_ * kPeriod)));
      EXPECT_TRUE(odometry_.next_odometry(false));
    }
    return {kStart + i * kPeriod};
  }
  program::FeedSensors sensors() {
    program::FeedSensors out;
    images.describe(out);
    return out;
  }
  RosIntake odometry_{{}};
  ImagesIntake images;

 private:
  int next_ = 0;
};

TEST(ImagesIntake, CamerasAndImuAreKnownOnceCalibrationAndPlaceAre) {
  Robot robot;
  expect(robot.images.missing(), "no images are used: /r/left/camera_info: no sensor_msgs/CameraInfo");
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  expect(robot.images.missing(), "/r/left/image_raw: no image");
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart))));
  expect(robot.images.missing(), "no odometry has said yet which frame is the body");
  robot.go(0);
  ASSERT_TRUE(robot.images.add_imu(imu(kStart)));
  expect(robot.images.missing(), "no transform from 'camera' to 'base_link' on /tf_static");
  EXPECT_TRUE(robot.sensors().cameras.empty());
  EXPECT_FALSE(robot.sensors().imu);
  robot.place();
  EXPECT_EQ(robot.images.missing(), "");
  const program::FeedSensors sensors = robot.sensors();
  ASSERT_EQ(sensors.cameras.size(), 1U);
  EXPECT_EQ(sensors.cameras[0].T_body_camera, kBodyCamera);
  EXPECT_EQ(sensors.cameras[0].model.fx, 3.0);
  EXPECT_EQ(sensors.imu, ImuNoise{});
  EXPECT_TRUE(program::check_sensors(sensors));
}

TEST(ImagesIntake, ImagesAndSamplesAreFedWhenOdometryCoversThem) {
  Robot robot({kLeft}, "/r/imu", {.time_offset_s = 0.05});
  robot.place();
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  robot.go(0);
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart - kPeriod))));  // before all odometry
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart))));            // at 0.05 s
  for (int i = 0; i <= 70; ++i) ASSERT_TRUE(robot.images.add_imu(imu(kStart + i * kPeriod / 10)));
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
  EXPECT_TRUE(program::check_images(*images, robot.sensors()));
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
  add(0, kStart);
  EXPECT_FALSE(robot.images.next_images({kStart}).value());  // the second's may come
  add(1, kStart + 1'000'000);
  const auto both = robot.images.next_images({kStart}).value();
  ASSERT_TRUE(both);
  ASSERT_EQ(both->images.size(), 2U);
  EXPECT_EQ(both->images[1].camera, 1U);
  add(0, kStart + kPeriod);
  add(1, kStart + 2 * kPeriod);  // the second's of that moment is lost
  EXPECT_EQ(robot.images.next_images(robot.go(1)).value()->images.size(), 1U);
  add(0, kStart + 2 * kPeriod);
  EXPECT_EQ(robot.images.next_images(robot.go(2)).value()->images.size(), 2U);
  add(0, kStart + 3 * kPeriod);
  EXPECT_FALSE(robot.images.next_images(robot.go(5)).value());
  EXPECT_EQ(robot.images.next_images(robot.go(6)).value()->images.size(), 1U);  // the second has ended
}

TEST(ImagesIntake, FilesStayAsTheyAre) {
  Robot robot({{"/r/image_raw/compressed", "/r/camera_info", true}}, "");
  robot.place();
  robot.go(0);
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  const bags::RosCompressedImage jpeg{.header = {{kStart}, "camera"}, .format = "jpeg", .data = "any bytes"};
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(jpeg)));
  const auto images = robot.images.next_images({kStart}).value();
  EXPECT_FALSE(images->images[0].is_raw);
  EXPECT_EQ(images->images[0].bytes, "any bytes");
}

TEST(ImagesIntake, WhatIsWrongIsSaid) {
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
  image.encoding = "16UC1";
  expect(add(image), "encoding '16UC1', expected mono8, ");
  expect(why(robot.images.add_image(0, odometry(kStart))), "sensor_msgs/msg/Image: ");
  expect(add(grey_image(0)), "are they by another clock?");
  EXPECT_EQ(add(grey_image(kStart)), "");
  expect(add(grey_image(kStart)), "two publishers, or a clock that began anew?");
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

TEST(ImagesIntake, LateImagesAndAnImuElsewhereAreSaid) {
  Robot robot;
  robot.go(0);
  ASSERT_TRUE(robot.odometry_.add_tf(transform(0, "base_link", "imu", kBodyCamera), true));
  ASSERT_TRUE(robot.images.add_info(0, bags::encode(calibration())));
  ASSERT_TRUE(robot.images.add_image(0, bags::encode(grey_image(kStart, "base_link"))));
  ASSERT_TRUE(robot.images.add_imu(imu(kStart)));
  EXPECT_EQ(robot.images.missing(), "no IMU is used: /r/imu: is 0.374 m from the body's origin, expected 0");
  EXPECT_EQ(robot.sensors().cameras.size(), 1U);
  EXPECT_FALSE(robot.sensors().imu);
  expect(robot.images.next_images(robot.go(6)).error().message, "comes 0.6 s after odometry of its time, expected at");
  EXPECT_FALSE(robot.images.next_images(robot.go(6)).value());
}

TEST(ImagesIntake, CamerasAreChosenByTypeAndSeveralAreSaid) {
  ImagesConfig config;
  ASSERT_TRUE(resolve(config, "r"));
  const auto topics = [](std::vector<std::pair<const char*, const char*>> all) {
    std::vector<Publication> out;
    for (const auto& [topic, type] : all) out.push_back({.topic = topic, .type = type, .user_data = {}});
    return out;
  };
  auto published = topics({{"/r/right/image_raw", kImageType},
                           {"/r/right/camera_info", kCameraInfoType},
                           {"/r/left/image_raw", kImageType},
                           {"/r/left/image_raw/compressed", kCompressedType},
                           {"/r/left/camera_info", kCameraInfoType},
                           {"/r/rviz", kImageType},
                           {"/s/image_raw", kImageType},
                           {"/s/camera_info", kCameraInfoType},
                           {"/s/imu", kImuType},
                           {"/r/imu", kImuType}});
  EXPECT_EQ(choose_cameras(published, config).value(), (std::vector{kLeft, kRight}));
  EXPECT_EQ(choose_imu(published, config).value(), "/r/imu");
  EXPECT_TRUE(choose_cameras(topics({}), config)->empty());
  config.most_cameras = 1;
  EXPECT_EQ(choose_cameras(published, config).value(), (std::vector{kLeft}));
  for (const auto& more : topics({{"/r/up/image_raw", kImageType}, {"/r/up/camera_info", kCameraInfoType}}))
    published.push_back(more);
  published.push_back({.topic = "/r/imu2", .type = kImuType, .user_data = {}});
  expect(choose_cameras(published, config).error().message,
         "3 cameras with 3 CameraInfo, expected one or two; say which: --images "
         "/r/left/image_raw,/r/right/image_raw,/r/up/image_raw");
  expect(choose_imu(published, config).error().message, "2 topics have one; say which: --imu /r/imu ");

  ImagesConfig named{.images = {"left/image_raw/compressed"}, .imu = "imu2"};
  ASSERT_TRUE(resolve(named, "r"));
  EXPECT_EQ(choose_cameras(published, named).value(),
            (std::vector{CameraTopics{"/r/left/image_raw/compressed", "/r/left/camera_info", true}}));
  EXPECT_EQ(choose_imu(published, named).value(), "/r/imu2");
  named.images.push_back("/r/none");
  EXPECT_TRUE(choose_cameras(published, named)->empty());
  EXPECT_FALSE(resolve(named, "a b"));
}

TEST(ImagesIntake, WhatWaitsHasAnEnd) {
  Robot robot({{"/r/image_raw/compressed", "/r/camera_info", true}});
  const std::string file(ImagesIntake::kMostBytes / 10, 'x');
  for (int i = 0; i < 30; ++i)
    ASSERT_TRUE(robot.images.add_image(
        0, bags::encode(bags::RosCompressedImage{.header = {{kStart + i}, "base_link"}, .format = {}, .data = file})));
  for (std::size_t i = 0; i < 2 * ImagesIntake::kMostSamples; ++i)
    ASSERT_TRUE(robot.images.add_imu(imu(kStart + static_cast<std::int64_t>(i), {0, 0, 0}, "base_link")));
  robot.go(0);
  std::size_t images = 0, samples = 0;
  while (robot.images.next_images({kStart + kPeriod}).value()) ++images;
  for (std::size_t some = 1; some > 0; samples += some) some = robot.images.next_imu({kStart}).size();
  EXPECT_EQ(images, 10U);
  EXPECT_EQ(samples, ImagesIntake::kMostSamples);
}

/// Any byte of any message may be wrong, and any message cut.
TEST(ImagesIntake, BytesOfStrangersDoNoHarm) {
  Robot robot;
  robot.place();
  robot.go(0);
  std::mt19937 rng(1);
  const std::vector<std::string> good{bags::encode(grey_image(kStart)), bags::encode(calibration()), imu(kStart)};
  std::size_t refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = good[rng() % good.size()];
    for (std::size_t k = 1 + rng() % 3; k > 0; --k) bytes[rng() % bytes.size()] = static_cast<char>(rng());
    if (rng() % 3 == 0) bytes.resize(rng() % bytes.size());
    const std::size_t kind = rng() % 3;
    const Status taken = kind == 0   ? robot.images.add_image(0, bytes)
                         : kind == 1 ? robot.images.add_info(0, bytes)
                                     : robot.images.add_imu(bytes);
    refused += taken ? 0 : 1;
    if (!robot.sensors().cameras.empty()) static_cast<void>(robot.images.next_images({kStart}));
    static_cast<void>(robot.images.next_imu({kStart}));
  }
  EXPECT_GT(refused, 15'000U);
}

}  // namespace images_intake_test
}  // namespace tutti::ros
