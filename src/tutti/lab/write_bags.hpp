// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/recording.hpp"

/// Recordings written as robots would have recorded them: a rosbag2 folder each.
namespace tutti::lab {

/// A robot as it is written. Its frames and topics begin with its name: alpha/base_link, /alpha/odom.
struct RobotToWrite {
  Recording recording;
  ImageStream images;  ///< No stamps when there is no camera.
  Pose3 T_body_lidar;
};

struct WrittenBag {
  std::string folder;
  std::uint64_t messages = 0;
};

/// What simulated missions count from: midnight of 1 January 2026, UTC. ROS takes a stamp of zero for none.
inline constexpr std::int64_t kBagsBegin_ns = 1'767'225'600'000'000'000;

/// Writes one message after the other in the order of time; holds a scan or an image. Topics, below the robot's name:
/// odom (nav_msgs/Odometry), points (PointCloud2: x y z time, float32, LiDAR frame, time in s before the stamp at which
/// the sweep ends: 0 or negative), imu, camera0 and depth (image_raw and camera_info), truth (PoseStamped in `world`);
/// and /tf, /tf_static. Odometry's twist is the motion since the sample before, and the covariance of that, divided by
/// the time and by its square, that of the increment (right tangent, as the twist's frame); the pose's covariance
/// is what has added up since the start, about the fixed axes of its frame. `offset_ns` is added to every stamp.
Result<WrittenBag> write_bag(const RobotToWrite& robot, const std::string& folder, std::int64_t offset_ns);

/// A mission with source simulation or hall: DIR/alpha, DIR/bravo, .. `progress` is told of each robot that is begun.
Result<std::vector<WrittenBag>> write_bags(const MissionConfig& config, std::uint64_t seed, const std::string& folder,
                                           const std::function<void(const std::string&)>& progress = {});

}  // namespace tutti::lab
