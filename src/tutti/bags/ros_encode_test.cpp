// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_encode.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "support/bags/bag_writer.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/mcap_reader.hpp"

namespace tutti::bags {
namespace ros_encode_test {

/// Bytes that were put together field by field elsewhere, decoded and encoded.
TEST(RosEncode, WhatIsDecodedIsEncodedToTheSameBytes) {
  const auto odometry = test::odometry(), tf = test::transforms(), cloud = test::point_cloud(), imu = test::imu(),
             image = test::image(), jpeg = test::compressed_image(), camera = test::camera_info(),
             fix = test::nav_sat_fix(), pose = test::pose_stamped();
  EXPECT_EQ(encode(decode_odometry(odometry).value()), odometry);
  EXPECT_EQ(encode(decode_tf(tf).value()), tf);
  EXPECT_EQ(encode(decode_point_cloud(cloud).value()), cloud);
  EXPECT_EQ(encode(decode_imu(imu).value()), imu);
  EXPECT_EQ(encode(decode_image(image).value()), image);
  EXPECT_EQ(encode(decode_compressed_image(jpeg).value()), jpeg);
  EXPECT_EQ(encode(decode_nav_sat_fix(fix).value()), fix);
  EXPECT_EQ(encode(decode_pose_stamped(pose).value()), pose);
  const std::string info = encode(decode_camera_info(camera).value());  // whose region of interest is passed over
  EXPECT_EQ(info.size(), camera.size());
  EXPECT_EQ(encode(decode_camera_info(info).value()), info);
}

TEST(RosEncode, StampsBefore1970Return) {
  for (const std::int64_t ns : {std::int64_t{-1}, std::int64_t{-1'000'000'000}, std::int64_t{-1'700'000'000}}) {
    RosPoseStamped message;
    message.header.stamp = Timestamp{ns};
    EXPECT_EQ(decode_pose_stamped(encode(message)).value().header.stamp.ns, ns);
  }
}

/// shared/data/mcap is what a real ROS 2 system wrote. Padding of /tf is whatever stood there, so that is not
/// compared.
TEST(RosEncode, OdometryOfARealBagIsIdentical) {
  TUTTI_REQUIRE_SHARED("data/mcap");
  auto reader = McapReader::open(::tutti::test::shared_path("data/mcap/nav2_turtlebot.mcap").string()).value();
  std::size_t odometry = 0, identical = 0;
  for (auto message = reader.next(); message && *message; message = reader.next())
    if (const BagMessage& one = **message; one.channel->type == "nav_msgs/msg/Odometry") {
      ++odometry;
      identical += encode(decode_odometry(one.data).value()) == one.data ? 1 : 0;
    }
  EXPECT_EQ(odometry, 2639U);
  EXPECT_EQ(identical, 2639U);
}

}  // namespace ros_encode_test
}  // namespace tutti::bags
