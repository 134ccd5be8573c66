// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_messages.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "support/bags/bag_writer.hpp"

namespace tutti::bags {
namespace ros_messages_test {

using namespace test;
constexpr std::int64_t kStampNs = 7'000'000'005;

/// Every type: is it taken?
struct Type {
  std::function<std::string(bool)> write;
  std::function<Status(std::string_view)> read;
};
template <class T>
Status status(const Result<T>& result) {
  return result ? Status{} : tl::unexpected(result.error());
}
const std::map<std::string, Type>& types() {
  static const std::map<std::string, Type> all{
      {"Odometry",
       {[](bool big) { return odometry("odom", "base_link", big); },
        [](std::string_view b) { return status(decode_odometry(b)); }}},
      {"TFMessage", {transforms, [](std::string_view b) { return status(decode_tf(b)); }}},
      {"PointCloud2", {point_cloud, [](std::string_view b) { return status(decode_point_cloud(b)); }}},
      {"CustomMsg", {livox, [](std::string_view b) { return status(decode_livox(b)); }}},
      {"Imu", {imu, [](std::string_view b) { return status(decode_imu(b)); }}},
      {"Image", {image, [](std::string_view b) { return status(decode_image(b)); }}},
      {"CompressedImage", {compressed_image, [](std::string_view b) { return status(decode_compressed_image(b)); }}},
      {"CameraInfo", {camera_info, [](std::string_view b) { return status(decode_camera_info(b)); }}},
      {"BatteryState",
       {[](int how) { return battery_state(24.5F, 0.5F, how); },
        [](std::string_view b) { return status(decode_battery_state(b)); }}},
      {"NavSatFix", {nav_sat_fix, [](std::string_view b) { return status(decode_nav_sat_fix(b)); }}},
      {"PoseStamped", {pose_stamped, [](std::string_view b) { return status(decode_pose_stamped(b)); }}},
  };
  return all;
}

TEST(RosMessages, EveryCutIsRefusedAndNamesTheType) {
  for (const auto& [name, type] : types())
    for (const bool big : {false, true}) {
      const std::string whole = type.write(big);
      ASSERT_TRUE(type.read(whole)) << name << ": " << type.read(whole).error().message;
      for (std::size_t size = 0; size < whole.size(); ++size) {
        const Status cut = type.read(std::string_view(whole).substr(0, size));
        ASSERT_FALSE(cut) << name << " of " << size << " bytes";
        EXPECT_NE(cut.error().message.find("/msg/" + name + ": "), std::string::npos) << cut.error().message;
      }
    }
}

TEST(RosMessages, PaddingIsPassedOverAndNothingElse) {
  for (const auto& [name, type] : types()) {
    EXPECT_TRUE(type.read(type.write(false) + std::string(3, '\0'))) << name;
    EXPECT_FALSE(type.read(type.write(false) + std::string(4, '\0'))) << name;
  }
}

TEST(RosMessages, OtherEncapsulationsAreRefused) {
  for (const auto& [name, type] : types()) {
    std::string bytes = type.write(false);
    bytes[1] = 7;  // XCDR2
    const Status status = type.read(bytes);
    ASSERT_FALSE(status) << name;
    EXPECT_EQ(status.error().code, ErrorCode::unsupported);
  }
}

TEST(RosMessages, LengthsThatLieAreRefused) {
  // The 4-byte length of the first text, or of the sequence of transforms.
  for (const auto& [name, type] : types()) {
    std::string bytes = type.write(false);
    bytes.replace(name == "TFMessage" ? 4 : 12, 4, "\xff\xff\xff\x7f");
    EXPECT_FALSE(type.read(bytes)) << name;
  }
}

/// Where its points' number stands: of 4 bytes behind header (8 + 4 + 12), timebase (at 24), point_num, id and rsvd.
TEST(RosMessages, PointsOfALivoxThatLieAreRefused) {
  const std::string good = livox();
  constexpr std::size_t kNumber = 4 + 32, kCount = 4 + 40;
  std::string bad = good;
  bad.replace(kCount, 4, "\xff\xff\xff\xff");
  EXPECT_EQ(
      decode_livox(bad).error().message,
      "livox_ros_driver2/msg/CustomMsg: byte 44: points has 4294967295 elements of 19 bytes at least, 59 bytes are "
      "left");
  bad = good;
  bad[kNumber] = 4;
  EXPECT_EQ(decode_livox(bad).error().message,
            "livox_ros_driver2/msg/CustomMsg: byte 44: 3 points, expected 4 as point_num says");
  bad[kCount] = 4;
  EXPECT_FALSE(decode_livox(bad));
  bad[kNumber] = bad[kCount] = 2;
  EXPECT_EQ(decode_livox(bad).error().message,
            "livox_ros_driver2/msg/CustomMsg: byte 83: 20 bytes are left, expected the end: another definition of the "
            "type?");
}

TEST(RosMessages, ScansAreDecodedByTheirType) {
  for (const ScanType& type : kScanTypes) {
    EXPECT_TRUE(is_scan_type(type.name));
    const bool is_livox = type.name.ends_with("CustomMsg");
    EXPECT_EQ(decode_scan(type.name, livox()).has_value(), is_livox) << type.name;
    EXPECT_EQ(decode_scan(type.name, point_cloud()).has_value(), !is_livox) << type.name;
  }
  EXPECT_FALSE(is_scan_type("sensor_msgs/msg/LaserScan"));
  EXPECT_EQ(decode_scan("sensor_msgs/msg/LaserScan", livox()).error().message,
            "type 'sensor_msgs/msg/LaserScan', expected one that holds scans: sensor_msgs/msg/PointCloud2, "
            "livox_ros_driver2/msg/CustomMsg, livox_ros_driver/msg/CustomMsg, livox_interfaces/msg/CustomMsg");
}

class BothOrders : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(LittleAndBig, BothOrders, ::testing::Bool());

TEST_P(BothOrders, OdometryAndTransformsAreReadFieldByField) {
  const auto sample = decode_odometry(odometry("odom", "base_link", GetParam())).value();
  EXPECT_EQ(sample.header.stamp.ns, kStampNs);
  EXPECT_EQ(sample.header.frame_id, "odom");
  EXPECT_EQ(sample.child_frame_id, "base_link");
  EXPECT_EQ(sample.pose.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(sample.pose.orientation.coeffs(), Eigen::Vector4d(4, 5, 6, 7));
  EXPECT_EQ(sample.pose_covariance[35], 135.0);
  EXPECT_EQ(sample.linear, Eigen::Vector3d(10, 11, 12));
  EXPECT_EQ(sample.angular, Eigen::Vector3d(13, 14, 15));
  EXPECT_EQ(sample.twist_covariance[0], 200.0);

  const auto both = decode_tf(transforms(GetParam())).value();
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[1].header.frame_id, "base");
  EXPECT_EQ(both[1].child_frame_id, "camera_left");
  EXPECT_EQ(both[1].translation, Eigen::Vector3d(8, 9, 10));
  EXPECT_EQ(both[1].rotation.w(), 14.0);

  const auto stamped = decode_pose_stamped(pose_stamped(GetParam())).value();
  EXPECT_EQ(stamped.header.frame_id, "map");
  EXPECT_EQ(stamped.pose.orientation.w(), 7.0);
}

TEST_P(BothOrders, SensorsAreReadFieldByField) {
  const std::string cloud_bytes = point_cloud(GetParam());
  const auto cloud = decode_point_cloud(cloud_bytes).value();
  EXPECT_EQ(cloud.width, 2U);
  ASSERT_EQ(cloud.fields.size(), 2U);
  EXPECT_EQ(cloud.fields[1].name, "time");
  EXPECT_EQ(cloud.fields[1].offset, 4U);
  EXPECT_EQ(cloud.fields[1].datatype, 8U);
  EXPECT_EQ(cloud.point_step, 12U);
  EXPECT_EQ(cloud.row_step, 24U);
  EXPECT_EQ(cloud.data, "abcdefghijklmnopqrstuvwx");
  EXPECT_TRUE(cloud.is_dense);

  const std::string livox_bytes = livox(GetParam());
  const auto custom = decode_livox(livox_bytes).value();
  EXPECT_EQ(custom.header.stamp.ns, kStampNs);
  EXPECT_EQ(custom.header.frame_id, "livox_frame");
  EXPECT_EQ(custom.height, 3U);
  EXPECT_EQ(custom.is_bigendian, GetParam());

  const auto inertial = decode_imu(imu(GetParam())).value();
  EXPECT_EQ(inertial.orientation.w(), 4.0);
  EXPECT_EQ(inertial.angular_velocity, Eigen::Vector3d(20, 21, 22));
  EXPECT_EQ(inertial.linear_acceleration, Eigen::Vector3d(40, 41, 42));
  EXPECT_EQ(inertial.linear_acceleration_covariance[8], 58.0);

  const std::string image_bytes = image(GetParam()), jpeg_bytes = compressed_image(GetParam());
  const auto grey = decode_image(image_bytes).value();
  EXPECT_EQ(grey.encoding, "mono8");
  EXPECT_EQ(grey.width, 3U);
  EXPECT_EQ(grey.data, "abc");
  const auto jpeg = decode_compressed_image(jpeg_bytes).value();
  EXPECT_EQ(jpeg.format, "jpeg");
  EXPECT_EQ(jpeg.data, "\xff\xd8");

  const auto camera = decode_camera_info(camera_info(GetParam())).value();
  EXPECT_EQ(camera.width, 752U);
  EXPECT_EQ(camera.distortion_model, "plumb_bob");
  EXPECT_EQ(camera.d, (std::vector<double>{1, 2, 3, 4, 5}));
  EXPECT_EQ(camera.k[0], 10.0);
  EXPECT_EQ(camera.p[11], 41.0);
  EXPECT_EQ(camera.binning_y, 2U);

  const auto ranged = decode_range(range(12.5F, 0.01F, GetParam())).value();
  EXPECT_EQ(ranged.range_m, 12.5F);
  EXPECT_EQ(ranged.max_range_m, 50.0F);
  EXPECT_EQ(ranged.variance, 0.01F);
  const auto battery = decode_battery_state(battery_state(24.5F, 0.5F, GetParam())).value();
  EXPECT_EQ(battery.voltage_v, 24.5F);
  EXPECT_EQ(battery.percentage, 0.5F);
  const auto fix = decode_nav_sat_fix(nav_sat_fix(GetParam())).value();
  EXPECT_EQ(fix.status, -1);
  EXPECT_EQ(fix.service, 3U);
  EXPECT_EQ(fix.altitude_m, 49.0);
  EXPECT_EQ(fix.position_covariance_type, 2U);
}

}  // namespace ros_messages_test
}  // namespace tutti::bags
