// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_types.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_encode.hpp"

namespace tutti::bags {
namespace ros_types_test {

TEST(RosTypes, EachIsThereOnceForSomethingAndHasADefinition) {
  std::set<std::string_view> names;
  for (const RosType& type : ros_types()) {
    EXPECT_TRUE(names.insert(type.name).second) << type.name;
    EXPECT_NE(type.use, Use::nothing) << type.name;
    EXPECT_EQ(use_of(type.name), type.use) << type.name;
    EXPECT_TRUE(has_ros_definition(std::string(type.name))) << type.name;
  }
  for (const ScanType& scan : kScanTypes) EXPECT_EQ(use_of(scan.name), Use::scans) << scan.name;
}

TEST(RosTypes, AMessageIsDecodedByItsType) {
  RosImu imu;
  imu.header.frame_id = "imu";
  const auto decoded = decode_message(kImuType, encode(imu), RosEncoding::cdr);
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(std::get<RosImu>(*decoded).header.frame_id, "imu");
  for (const RosType& type : ros_types())
    EXPECT_FALSE(decode_message(type.name, "x", RosEncoding::cdr).has_value()) << type.name;
  EXPECT_EQ(use_of("std_msgs/msg/String"), Use::nothing);
  EXPECT_EQ(decode_message("std_msgs/msg/String", "x", RosEncoding::cdr).error().message,
            "type 'std_msgs/msg/String', which is not decoded");
}

}  // namespace ros_types_test
}  // namespace tutti::bags
