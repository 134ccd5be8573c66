// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"

/// The types of ROS's messages that Tutti reads: what bags, DDS, the live feed and Python know of a type is here.
namespace tutti::bags {

inline constexpr const char *kOdometryType = "nav_msgs/msg/Odometry", *kPoseType = "geometry_msgs/msg/PoseStamped",
                            *kTfType = "tf2_msgs/msg/TFMessage", *kImageType = "sensor_msgs/msg/Image",
                            *kCompressedType = "sensor_msgs/msg/CompressedImage",
                            *kCameraInfoType = "sensor_msgs/msg/CameraInfo", *kImuType = "sensor_msgs/msg/Imu",
                            *kFixType = "sensor_msgs/msg/NavSatFix", *kBatteryType = "sensor_msgs/msg/BatteryState",
                            *kRangeType = "sensor_msgs/msg/Range";

/// The use that Tutti has for a topic, by its message type alone.
enum class Use { nothing, odometry, scans, images, calibration, imu, fixes, poses, transforms, battery, ranges };

using RosMessage = std::variant<RosOdometry, RosPoseStamped, std::vector<RosTransform>, RosPointCloud, RosImage,
                                RosCompressedImage, RosCameraInfo, RosImu, RosNavSatFix, RosBatteryState, RosRange>;

struct RosType {
  std::string_view name;
  Use use = Use::nothing;
  Result<RosMessage> (*decode)(std::string_view bytes, RosEncoding encoding) = nullptr;
};

/// All of them, those of scans (kScanTypes) last.
std::span<const RosType> ros_types();
/// ROS 1's name of a type as ROS 2 has it: "nav_msgs/Odometry" is "nav_msgs/msg/Odometry" today, and tf's messages are
/// tf2's. Other names stay as they are.
std::string type_of_ros2(const std::string& type);
/// ROS 2's name of a type as ROS 1 and definitions have it: "nav_msgs/msg/Odometry" is "nav_msgs/Odometry". Other names
/// stay as they are.
std::string type_of_ros1(std::string_view type);
/// Nothing for a type that is not among them.
Use use_of(std::string_view type);
/// Decodes as ros_messages.hpp has it; errors: also another type.
Result<RosMessage> decode_message(std::string_view type, std::string_view bytes, RosEncoding encoding);

}  // namespace tutti::bags
