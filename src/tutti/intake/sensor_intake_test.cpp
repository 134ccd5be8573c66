// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/sensor_intake.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/intake/camera_robot.hpp"

namespace tutti::intake {
namespace sensor_intake_test {

using namespace test;

constexpr const char *kOdometry = "nav_msgs/msg/Odometry", *kTf = "tf2_msgs/msg/TFMessage",
                     *kPoints = "sensor_msgs/msg/PointCloud2", *kFix = "sensor_msgs/msg/NavSatFix",
                     *kBattery = "sensor_msgs/msg/BatteryState";

/// The inputs that come out, one letter each: odometry, scan, pictures, imu, fix, range, health; '!' for an error.
struct Letters {
  std::string out;
  std::vector<std::string> errors;
  std::vector<OdometrySample> samples;
  std::vector<EncodedImages> images;
  std::vector<RobotRange> ranges;
  void operator()(const OdometrySample& sample) { out += 'o', samples.push_back(sample); }
  void operator()(const Scan&) { out += 's'; }
  void operator()(const EncodedImages& images_then) { out += 'p', images.push_back(images_then); }
  void operator()(const TrackedImages&) { out += 't'; }
  void operator()(const std::vector<ImuSample>&) { out += 'i'; }
  void operator()(const PositionFix&) { out += 'f'; }
  void operator()(const Health&) { out += 'h'; }
  void operator()(const StartPose&) { out += 'a'; }
  void operator()(const RobotRange& range) { out += 'r', ranges.push_back(range); }
};

class SensorIntakeTest : public testing::Test {
 protected:
  void take_images(ImagesConfig config) {
    auto topics = named_topics(config).value();
    std::string imu = config.imu;
    intake_.take_images(std::move(config), std::move(topics), std::move(imu));
  }
  std::string add(const char* topic, const char* type, const std::string& bytes, const char* encoding = "cdr") {
    const Status taken = intake_.add({topic, type, encoding, bytes});
    return taken ? "" : taken.error().message;
  }
  std::string odometry_at(int i) { return add("odom", kOdometry, odometry(kStart + i * kPeriod, 0.1 * i)); }
  std::string range_at(const std::string& to, std::int64_t stamp) {
    return add(("range_to/" + to).c_str(), bags::kRangeType, range(stamp, 5.0F, "base_link"));
  }
  void place() {
    for (const char* frame : {"camera", "imu", "lidar"})
      EXPECT_EQ(add("/tf_static", kTf, transform(0, "base_link", frame, {})), "");
  }
  /// All that is due.
  std::string due(bool wants_scan = true) {
    Letters letters;
    while (true) {
      auto input = intake_.next(wants_scan);
      if (!input) {
        letters.out += '!';
        letters.errors.push_back(input.error().message);
      } else if (!*input) {
        break;
      } else {
        std::visit(letters, **input);
      }
    }
    last_ = std::move(letters);
    return last_.out;
  }
  SensorIntake intake_{{}};
  Letters last_;
};

TEST_F(SensorIntakeTest, EveryTypeOfMessageMakesItsInputInTheOrderThatARobotWants) {
  take_images({.images = {"left/image_raw"}, .imu = "imu"});
  place();
  EXPECT_EQ(add("points", kPoints, points(kStart, kAtOnce, "lidar")), "");
  EXPECT_EQ(add("left/camera_info", bags::kCameraInfoType, bags::encode(calibration())), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart))), "");
  EXPECT_EQ(add("imu", bags::kImuType, imu(kStart)), "");
  EXPECT_EQ(add("battery_state", kBattery, bags::test::battery_state(24.5F, 0.5F)), "");
  EXPECT_EQ(due(), "h");
  EXPECT_EQ(add("fix", kFix, fix(kStart)), "");
  EXPECT_TRUE(intake_.sensors().cameras.empty());
  EXPECT_EQ(odometry_at(0), "");
  EXPECT_EQ(due(), "ofips");
  EXPECT_EQ(intake_.sensors().cameras.size(), 1U);
  EXPECT_TRUE(intake_.sensors().imu);
  EXPECT_EQ(intake_.missing(), "");
  const auto notes = intake_.take_notes();
  ASSERT_EQ(notes.size(), 3U);
  EXPECT_EQ(notes[0], "takes images of left/image_raw, imu");
  EXPECT_TRUE(intake_.take_notes().empty());
  EXPECT_EQ(add("points", "livox_ros_driver2/msg/CustomMsg", livox(kStart + kPeriod)), "");
  for (int i = 1; i < 4; ++i) EXPECT_EQ(odometry_at(i), "");
  EXPECT_EQ(due(), "ooos");  // as soon as odometry has reached the end of its sweep
}

TEST_F(SensorIntakeTest, WhatIsNoSuchMessageIsAnErrorThatSaysWhere) {
  EXPECT_EQ(add("odom", kOdometry, odometry(kStart), "json").substr(0, 6), "odom: ");
  expect(add("chatter", "std_msgs/msg/String", ""),
         "chatter: messages of type 'std_msgs/msg/String', expected one of nav_");
  expect(add("odom", kOdometry, "abc"), "odom: ");
  expect(add("points", kPoints, ""), "points: ");
  EXPECT_EQ(due(), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, "of nobody's camera"), "");  // is not looked at
}

TEST_F(SensorIntakeTest, MessagesOfRos1AreTheSame) {
  bags::test::CdrWriter out(2);
  out.header("odom").text("base_link").numbers(3, 1.0).number(0.0).number(0.0).number(0.0).number(1.0);
  out.numbers(36, 0.0).numbers(6, 0.0).numbers(36, 0.0);
  EXPECT_EQ(add("odom", kOdometry, out.done(), "ros1"), "");
  EXPECT_EQ(due(), "o");
}

TEST_F(SensorIntakeTest, ScansAndImagesOfWhichSomethingIsNotKnownAreReported) {
  take_images({.images = {"left/image_raw/compressed"}});
  EXPECT_EQ(odometry_at(0), "");
  EXPECT_EQ(due(), "o");
  EXPECT_EQ(add("points", kPoints, points(kStart, kAtOnce, "lidar")), "");
  EXPECT_EQ(due(), "");  // it may still come
  EXPECT_EQ(odometry_at(51), "");
  EXPECT_EQ(due(), "!o");
  expect(last_.errors[0], "points: where the LiDAR is on the robot is not known");
  EXPECT_EQ(odometry_at(60), "");
  EXPECT_EQ(due(), "o");
  EXPECT_EQ(odometry_at(61), "");
  EXPECT_EQ(intake_.missing(), "no images are used: left/camera_info: no sensor_msgs/CameraInfo");
}

TEST_F(SensorIntakeTest, ImagesOfBeforeTheirCameraWasKnownAreLeftOutSilently) {
  take_images({.images = {"left/image_raw"}});
  EXPECT_EQ(add("left/camera_info", bags::kCameraInfoType, bags::encode(calibration())), "");
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(odometry_at(i), "");
    EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart + i * kPeriod))), "");
    EXPECT_EQ(due(), "o");
  }
  place();
  EXPECT_EQ(due(), "pppppp");  // half a second
  EXPECT_EQ(last_.images.back().stamp.ns, kStart + 19 * kPeriod);
}

TEST_F(SensorIntakeTest, AtTheEndNothingIsWaitedFor) {
  take_images({.images = {"left/image_raw", "right/image_raw"}});
  place();
  EXPECT_EQ(odometry_at(0), "");
  for (const char* side : {"left", "right"}) {
    EXPECT_EQ(add(fmt::format("{}/camera_info", side).c_str(), bags::kCameraInfoType, bags::encode(calibration())), "");
    EXPECT_EQ(add(fmt::format("{}/image_raw", side).c_str(), bags::kImageType, bags::encode(grey_image(kStart))), "");
  }
  EXPECT_EQ(due(), "op");
  EXPECT_EQ(last_.images[0].images.size(), 2U);
  EXPECT_EQ(odometry_at(1), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart + kPeriod))), "");
  EXPECT_EQ(due(), "o");  // the other may come
  intake_.end();
  EXPECT_EQ(due(), "p");
}

/// Where nothing may be lost.
TEST_F(SensorIntakeTest, OdometryWaitsForScansAndForCamerasForAWhile) {
  take_images({.images = {"left/image_raw"}});
  place();
  EXPECT_TRUE(intake_.wants("left/image_raw"));
  EXPECT_TRUE(intake_.wants("left/camera_info"));
  EXPECT_FALSE(intake_.wants("right/image_raw"));
  intake_.hold_odometry(true, true);
  EXPECT_EQ(odometry_at(0), "");
  EXPECT_EQ(add("points", kPoints, points(kStart, kAtOnce, "lidar")), "");
  EXPECT_EQ(due(), "") << "no image yet";
  EXPECT_EQ(add("left/camera_info", bags::kCameraInfoType, bags::encode(calibration())), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart))), "");
  EXPECT_FALSE(intake_.wants("left/camera_info")) << "the first one counts";
  EXPECT_EQ(due(), "ops");
  EXPECT_EQ(odometry_at(1), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart + kPeriod))), "");
  EXPECT_EQ(due(), "") << "no scan yet";
  intake_.hold_odometry(false, true);
  EXPECT_EQ(due(), "op");
  EXPECT_EQ(odometry_at(2), "");
  EXPECT_EQ(due(), "") << "no image yet";
  constexpr int kHeld = static_cast<int>(waiting::kHeld_s) * static_cast<int>(kSecond / kPeriod);
  EXPECT_EQ(odometry_at(2 + kHeld), "");
  EXPECT_EQ(due(), "") << "images may come yet";
  EXPECT_EQ(odometry_at(3 + kHeld), "");
  EXPECT_EQ(due(), "o") << "images have ended";
}

TEST_F(SensorIntakeTest, OdometryWaitsForCamerasWhileThereIsRoomForWhatComesMeanwhile) {
  take_images({.images = {"left/image_raw"}, .imu = "imu"});
  place();
  intake_.hold_odometry(false, true);
  EXPECT_EQ(odometry_at(0), "");
  EXPECT_EQ(add("left/camera_info", bags::kCameraInfoType, bags::encode(calibration())), "");
  EXPECT_EQ(add("left/image_raw", bags::kImageType, bags::encode(grey_image(kStart))), "");
  EXPECT_EQ(add("imu", bags::kImuType, imu(kStart)), "");
  EXPECT_EQ(due(), "oip");
  EXPECT_EQ(odometry_at(8), "");
  const auto fill = [&](std::size_t from, std::size_t until) {
    for (std::size_t i = from; i < until; ++i)
      EXPECT_EQ(add("imu", bags::kImuType, imu(kStart + 7 * kPeriod + static_cast<std::int64_t>(i) * 1000)), "");
  };
  fill(0, ImagesIntake::kMostSamples / 2);
  EXPECT_EQ(due(), "") << "no image yet";
  fill(ImagesIntake::kMostSamples / 2, ImagesIntake::kMostSamples / 2 + 1);
  EXPECT_EQ(due(), "oii");
}

TEST_F(SensorIntakeTest, OdometryThatIsSentAgainShowsHowTheBodyMoved) {
  intake_.odometry().begin_behind(Timestamp{kStart + 10 * kPeriod});
  for (int i = 0; i <= 12; ++i) EXPECT_EQ(odometry_at(i), "");
  EXPECT_EQ(due(), "oo");
  EXPECT_EQ(last_.samples[0].stamp.ns, kStart + 11 * kPeriod);
  EXPECT_LT(last_.samples[0].increment_covariance(0, 0), 0.01);
  EXPECT_EQ(add("points", kPoints, points(kStart + 11 * kPeriod, kSweepBefore)), "");
  EXPECT_EQ(due(), "s");

  SensorIntake other{{}};  // which does not get it
  other.odometry().begin_behind(Timestamp{kStart});
  EXPECT_TRUE(other.add({"odom", kOdometry, "cdr", odometry(kStart + kPeriod)}));
  const auto first = other.next(true).value();
  EXPECT_EQ(std::get<OdometrySample>(*first).increment_covariance(0, 0), 1.0);
}

TEST(NamedTopics, AreThoseOfOneCameraOrTwo) {
  const auto topics = named_topics({.images = {"a/image_raw/compressed"}, .depth = "d/image_raw"}).value();
  ASSERT_EQ(topics.size(), 2U);
  EXPECT_EQ(topics[0].info, "a/camera_info");
  EXPECT_TRUE(topics[0].is_compressed);
  EXPECT_EQ(topics[1].info, "d/camera_info");
  EXPECT_TRUE(named_topics({})->empty());
  for (const ImagesConfig& wrong :
       {ImagesConfig{.images = {"a/i", "b/i", "c/i"}}, {.images = {"a/i", "a/j"}}, {.depth = "d"}, {.imu = "imu"}})
    EXPECT_FALSE(named_topics(wrong));
}

TEST_F(SensorIntakeTest, RangesAreToTheRobotThatTheirTopicNames) {
  const char* const kRange = "sensor_msgs/msg/Range";
  EXPECT_EQ(add("/tf_static", kTf, transform(0, "base_link", "uwb", {Eigen::Quaterniond::Identity(), {1, 2, 3}})), "");
  EXPECT_EQ(odometry_at(0), "");
  EXPECT_EQ(add("sonar", kRange, range(kStart, 1.0F, "uwb")), "") << "to a wall";
  EXPECT_EQ(add("range_to/bravo", kRange, range(kStart + kPeriod, 5.0F, "uwb")), "");
  EXPECT_EQ(add("range_to/charlie", kRange, range(kStart + kPeriod, 6.0F, "nowhere")), "");
  EXPECT_NE(add("range_to/bravo", kRange, range(kStart + kPeriod, -1.0F, "uwb", 0.0F)), "");
  EXPECT_EQ(due(), "o");
  EXPECT_EQ(odometry_at(1), "");
  EXPECT_EQ(due(), "orr");
  ASSERT_EQ(last_.ranges.size(), 2U);
  EXPECT_EQ(last_.ranges[0].name, "bravo");
  EXPECT_EQ(last_.ranges[0].distance_m, 5.0);
  EXPECT_EQ(last_.ranges[0].p_body_antenna, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(last_.ranges[1].name, "charlie");
  EXPECT_EQ(last_.ranges[1].p_body_antenna, Eigen::Vector3d(0, 0, 0));
  const auto notes = intake_.take_notes();
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[0], "ranges are of an antenna at [1.00 2.00 3.00] m of the body");
  EXPECT_NE(notes[1].find("at the body's origin: no transform from 'nowhere' to 'base_link'"), std::string::npos)
      << notes[1];
}

TEST_F(SensorIntakeTest, FixesAndRangesWaitForOdometryByTheSameRules) {
  constexpr std::int64_t kHour = 3'600'000'000'000;
  EXPECT_EQ(range_at("bravo", kStart + kHour), "") << "nobody can know that it is wrong";
  EXPECT_EQ(odometry_at(0), "");
  expect(range_at("charlie", kStart + kHour), "range_to/charlie: stamp 1700003600000000000 ns is 3600.0 s from");
  EXPECT_EQ(range_at("bravo", kStart + 40), "");
  expect(range_at("bravo", kStart + 40), "two publishers");
  EXPECT_EQ(range_at("charlie", kStart + 20), "");
  EXPECT_EQ(add("fix", kFix, fix(kStart + 30)), "");
  EXPECT_EQ(range_at("delta", kStart - 10), "") << "before odometry begins, it is passed over";
  EXPECT_EQ(due(), "o");
  EXPECT_EQ(odometry_at(1), "");
  EXPECT_EQ(due(), "orfr") << "by their stamps";
  ASSERT_EQ(last_.ranges.size(), 2U);
  EXPECT_EQ(last_.ranges[0].name, "charlie");
  EXPECT_EQ(last_.ranges[1].name, "bravo");
  EXPECT_EQ(intake_.odometry().counts().refused, 2U);
}

TEST_F(SensorIntakeTest, RangesThatTheRobotHasArePassedOver) {
  intake_.odometry().begin_behind(Timestamp{kStart + kPeriod});
  EXPECT_EQ(range_at("bravo", kStart + kPeriod), "");
  EXPECT_EQ(range_at("bravo", kStart + 2 * kPeriod), "");
  for (int i = 2; i < 4; ++i) EXPECT_EQ(odometry_at(i), "");
  EXPECT_EQ(due(), "oro");
}

}  // namespace sensor_intake_test
}  // namespace tutti::intake
