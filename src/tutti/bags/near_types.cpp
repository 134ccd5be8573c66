// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/near_types.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "tutti/bags/ros_types.hpp"

namespace tutti::bags {
namespace {

struct NearType {
  std::string_view name;  ///< PACKAGE/NAME; "PACKAGE/" is every type of the package.
  std::string_view way_on;
};

constexpr std::string_view kVelodyne =
    "packets of a LiDAR, not clouds: play the bag beside velodyne_pointcloud (its velodyne_transform_node), and record "
    "/velodyne_points";
constexpr std::string_view kOuster =
    "packets of a LiDAR, not clouds: ouster_ros's replay.launch makes /ouster/points of them; record these";
constexpr std::string_view kHesai =
    "packets of a LiDAR, not clouds: the LiDAR's driver makes /lidar_points of them (source: a bag of packets); record "
    "these";
constexpr std::string_view kRobosense =
    "packets of a LiDAR, not clouds: rslidar_sdk makes /rslidar_points of them (msg_source 2); record these";
constexpr std::string_view kNebula = "packets of a LiDAR, not clouds: nebula_ros makes clouds of them; record these";
constexpr std::string_view kLivox =
    "packets or an older message of a Livox, not read: livox_ros_driver2 publishes its CustomMsg or PointCloud2 "
    "(xfer_format 1 or 0); record these";
constexpr std::string_view kPlane =
    "one plane of a laser, not a cloud: laser_geometry makes sensor_msgs/PointCloud2 of it, but closures from a single "
    "plane were never tried";
constexpr std::string_view kPose =
    "poses with covariance are not read: record nav_msgs/Odometry of the same program, its /tf, or "
    "geometry_msgs/PoseStamped (ros2 run topic_tools transform TOPIC /pose geometry_msgs/msg/PoseStamped "
    "'geometry_msgs.msg.PoseStamped(header=m.header, pose=m.pose.pose)' --import geometry_msgs)";
constexpr std::string_view kTransform =
    "a transform that is not on /tf is not read: record /tf, or nav_msgs/Odometry of the same program";
constexpr std::string_view kPath =
    "a whole trajectory in each message is not read: record nav_msgs/Odometry of the same program";
constexpr std::string_view kPx4 =
    "PX4's own message (z down) is not read: MAVROS, or a node that turns it to z up, publishes nav_msgs/Odometry; "
    "record that";
constexpr std::string_view kFoxglove =
    "messages of Foxglove's schemas are not read: record ROS's (nav_msgs/Odometry, sensor_msgs/PointCloud2, ..)";
constexpr std::string_view kFix =
    "not read: gps_tools's (gps_common's) fix_translator makes sensor_msgs/NavSatFix of it";
constexpr std::string_view kNmea = "not read: nmea_navsat_driver (nmea_topic_driver) makes sensor_msgs/NavSatFix of it";
constexpr std::string_view kVideo =
    "video is not read: ros2 run image_transport republish makes sensor_msgs/Image or CompressedImage of it; record "
    "these";
constexpr std::string_view kOldCloud =
    "ROS's older clouds are not read: point_cloud_converter makes sensor_msgs/PointCloud2 of them";

constexpr std::array kTypes{
    NearType{"velodyne_msgs/", kVelodyne},
    NearType{"ouster_ros/", kOuster},
    NearType{"ouster_msgs/", kOuster},
    NearType{"ouster_sensor_msgs/", kOuster},
    NearType{"hesai_ros_driver/", kHesai},
    NearType{"hesai_lidar/", kHesai},
    NearType{"pandar_msgs/", kHesai},
    NearType{"rslidar_msg/", kRobosense},
    NearType{"rslidar_msgs/", kRobosense},
    NearType{"robosense_msgs/", kRobosense},
    NearType{"nebula_msgs/", kNebula},
    NearType{"livox_sdk_vehicle_msgs/", kLivox},
    NearType{"sensor_msgs/LaserScan", kPlane},
    NearType{"sensor_msgs/MultiEchoLaserScan", kPlane},
    NearType{"sensor_msgs/PointCloud", kOldCloud},
    NearType{"geometry_msgs/PoseWithCovarianceStamped", kPose},
    NearType{"geometry_msgs/TransformStamped", kTransform},
    NearType{"nav_msgs/Path", kPath},
    NearType{"px4_msgs/VehicleOdometry", kPx4},
    NearType{"foxglove.PoseInFrame", kFoxglove},
    NearType{"foxglove.PosesInFrame", kFoxglove},
    NearType{"foxglove.FrameTransform", kFoxglove},
    NearType{"foxglove.FrameTransforms", kFoxglove},
    NearType{"foxglove.PointCloud", kFoxglove},
    NearType{"foxglove.LaserScan", kFoxglove},
    NearType{"foxglove.RawImage", kFoxglove},
    NearType{"foxglove.CompressedImage", kFoxglove},
    NearType{"gps_common/GPSFix", kFix},
    NearType{"gps_msgs/GPSFix", kFix},
    NearType{"nmea_msgs/", kNmea},
    NearType{"theora_image_transport/", kVideo},
    NearType{"ffmpeg_image_transport_msgs/", kVideo},
    NearType{"foxglove_msgs/CompressedVideo", kVideo},
};

}  // namespace

std::string_view way_on(std::string_view type) {
  const std::string name = type_of_ros1(type);
  const auto* found = std::ranges::find_if(kTypes, [&](const NearType& near) {
    return near.name.ends_with('/') ? name.starts_with(near.name) : name == near.name;
  });
  return found == kTypes.end() ? std::string_view() : found->way_on;
}

std::vector<std::string> near_types(const BagInfo& info) {
  std::vector<std::string> out;
  for (const TopicInfo& topic : info.topics)
    if (const std::string_view way = way_on(topic.type); !way.empty() && topic.count > 0)
      out.push_back(fmt::format("{:<12} {} ({}): {}", "near", topic.topic, topic.type, way));
  return out;
}

}  // namespace tutti::bags
