// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::bags {
namespace camera_test {

RosCameraInfo info(const std::string& model, std::vector<double> d) {
  RosCameraInfo out{.height = 480, .width = 752, .distortion_model = model, .d = std::move(d)};
  out.k = {460, 0, 370, 0, 458, 250, 0, 0, 1};
  return out;
}

TEST(BagCamera, EveryModelIsTaken) {
  const auto kind = [](const RosCameraInfo& message) { return to_camera(message).value().kind; };
  EXPECT_EQ(kind(info("plumb_bob", {-0.3, 0.1, 0.0, 0.0, 0.0})), CameraKind::pinhole);
  EXPECT_EQ(kind(info("plumb_bob", {-0.3, 0.1, 0.0, 0.0, 0.01})), CameraKind::rational);
  EXPECT_EQ(kind(info("rational_polynomial", {0.1, 0.01, 0, 0, 0, 0.1, 0, 0})), CameraKind::rational);
  EXPECT_EQ(kind(info("fisheye", {0.01, 0, 0, 0})), CameraKind::equidistant);
  EXPECT_EQ(kind(info("", {})), CameraKind::pinhole);
  EXPECT_EQ(kind(info("radtan", {-0.3, 0.1, 0.001, 0.002})), CameraKind::pinhole);  // Kalibr
  EXPECT_EQ(kind(info("Brown-Conrady", {-0.3, 0.1, 0, 0, 0.01})), CameraKind::rational);
  EXPECT_EQ(kind(info("Equidistant", {0.01, 0, 0, 0})), CameraKind::equidistant);
  EXPECT_EQ(kind(info("kannala_brandt4", {0.01, 0, 0, 0})), CameraKind::equidistant);
  EXPECT_EQ(kind(info("rational_polynomial", {0.1, 0.01, 0, 0, 0.02})), CameraKind::rational);
  EXPECT_FALSE(to_camera(info("inverse_brown_conrady", {0.1, 0.01, 0, 0, 0.02})));
  EXPECT_EQ(kind(info("equidistant", {0.01, 0.02, 0, 0, 0})), CameraKind::equidistant);  // a T265
  EXPECT_EQ(kind(info("rational_polynomial", {0.1, 0.01, 0, 0, 0, 0.1, 0, 0, 0, 0, 0, 0, 0, 0})), CameraKind::rational);
  EXPECT_EQ(kind(info("rational_polynomial", {0, 0, 0, 0, 0, 0, 0, 0})), CameraKind::pinhole);
  EXPECT_EQ(kind(info("None", {0, 0, 0, 0, 0})), CameraKind::pinhole);
  EXPECT_EQ(kind(info("plumb_bob", {-0.3, 0.1, 0, 0, 0, 0, 0, 0})), CameraKind::pinhole);
  EXPECT_FALSE(to_camera(info("rational_polynomial", {0.1, 0, 0, 0, 0, 0, 0, 0, 0.01, 0, 0, 0})));
  EXPECT_FALSE(to_camera(info("equidistant", {0.01, 0.02})));
  const CameraModel camera = to_camera(info("plumb_bob", {-0.3, 0.1, 0.001, 0.002, 0.0})).value();
  EXPECT_EQ(camera.fy, 458.0);
  EXPECT_EQ(camera.cx, 370.0);
  EXPECT_EQ(camera.distortion[3], 0.002);
}

TEST(BagCamera, OneThatIsNotCalibratedIsRefused) {
  RosCameraInfo none = info("plumb_bob", {0, 0, 0, 0, 0});
  none.k = {};
  EXPECT_NE(to_camera(none).error().message.find("is the camera calibrated?"), std::string::npos);
  EXPECT_NE(to_camera(info("thin_prism", {1, 2})).error().message.find("'thin_prism' with 2 numbers"),
            std::string::npos);
  none = info("plumb_bob", {});
  none.binning_x = 2;
  EXPECT_FALSE(to_camera(none));
}

TEST(BagCamera, CalibrationIsBesideImages) {
  EXPECT_EQ(camera_info_topic("/a/image_raw", false), "/a/camera_info");
  EXPECT_EQ(camera_info_topic("/a/image_raw/compressed", true), "/a/camera_info");
}

TEST(BagCamera, ImuSamplesAreTurnedIntoTheBodyAndMustBeFinite) {
  RosImu message{.header = {{7}, "imu"}, .angular_velocity = {1, 2, 3}, .linear_acceleration = {4, 5, 6}};
  const Pose3 turn{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 0, 0.0005}};
  const ImuSample sample = in_body(to_imu_sample(message).value(), turn);
  EXPECT_EQ(sample.stamp.ns, 7);
  EXPECT_LT((sample.gyro - Eigen::Vector3d(-2, 1, 3)).norm(), 1e-12);
  EXPECT_LT((sample.accelerometer - Eigen::Vector3d(-5, 4, 6)).norm(), 1e-12);
  EXPECT_TRUE(check_imu_place(turn));
  EXPECT_FALSE(check_imu_place({turn.rotation, {0, 0, 0.1}}));
  message.linear_acceleration.z() = NAN;
  EXPECT_FALSE(to_imu_sample(message));
}

}  // namespace camera_test
}  // namespace tutti::bags
