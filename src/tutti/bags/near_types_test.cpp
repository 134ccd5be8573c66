// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/near_types.hpp"

#include <gtest/gtest.h>

#include "tutti/bags/ros_types.hpp"

namespace tutti::bags {
namespace near_types_test {

TEST(NearTypes, HaveAWayOnByBothNames) {
  for (const char* type : {"velodyne_msgs/msg/VelodyneScan", "velodyne_msgs/VelodyneScan", "sensor_msgs/msg/LaserScan",
                           "geometry_msgs/msg/PoseWithCovarianceStamped", "ouster_sensor_msgs/msg/PacketMsg",
                           "sensor_msgs/msg/PointCloud", "livox_sdk_vehicle_msgs/msg/CustomMsg",
                           "px4_msgs/msg/VehicleOdometry", "foxglove.PointCloud", "nmea_msgs/msg/Sentence"})
    EXPECT_FALSE(way_on(type).empty()) << type;
  EXPECT_TRUE(way_on("std_msgs/msg/String").empty());
  EXPECT_TRUE(way_on("").empty());
}

TEST(NearTypes, AreNotThoseThatAreRead) {
  for (const RosType& type : ros_types()) EXPECT_TRUE(way_on(type.name).empty()) << type.name;
}

TEST(NearTypes, AreNamedWhereThereAreMessages) {
  BagInfo info;
  info.topics.push_back({.topic = "/packets", .type = "velodyne_msgs/msg/VelodyneScan", .count = 3});
  info.topics.push_back({.topic = "/scan", .type = "sensor_msgs/msg/LaserScan", .count = 0});
  const auto lines = near_types(info);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(lines[0].starts_with("near         /packets (velodyne_msgs/msg/VelodyneScan): packets of a LiDAR"))
      << lines[0];
}

}  // namespace near_types_test
}  // namespace tutti::bags
