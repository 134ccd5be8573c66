// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/model/recording.hpp"

/// Writes recordings as robots would have recorded them: one rosbag2 folder for each robot.
namespace tutti::lab {

/// A robot to be written. Its frames and topics begin with its name: alpha/base_link, /alpha/odom.
struct RobotToWrite {
  Recording recording;
  Pose3 T_body_lidar;
};

struct WrittenBag {
  std::string folder;
  std::uint64_t messages = 0;
  double duration_s = 0.0;  ///< From the robot's first sample to its last message.
  double planned_s = 0.0;   ///< The same of all that there was to write: more, if it was stopped.
};

/// Who watches while bags are written.
struct Watch {
  /// Called from time to time with the robot's name and how much of all bags is written, of 1.
  std::function<void(const std::string& robot, double share)> progress;
  /// Asked between messages. Once it is true, the bag is closed as it is, and no other is begun. Not set: never.
  std::function<bool()> stop;
};

/// Time zero of simulated missions: midnight of 1 January 2026, UTC. A stamp of zero means "no stamp" in ROS.
inline constexpr std::int64_t kBagsBegin_ns = 1'767'225'600'000'000'000;

/// Writes one robot's messages in order of time, with one scan or image in memory. Topics, below the robot's name: odom
/// (nav_msgs/Odometry), points (PointCloud2 with x y z time, float32, in the LiDAR's frame; time is in s relative to
/// the stamp, at which the sweep ends, so 0 or negative), imu, camera0 and depth (image_raw and camera_info), truth
/// (PoseStamped in `world`); and /tf, /tf_static.
///
/// Odometry's twist is the motion since the previous sample, divided by the time; its covariance is the increment's
/// (right tangent, in the twist's frame), divided by the time squared. The pose's covariance is what has added up since
/// the start, about the fixed axes of its frame. `offset_ns` is added to every stamp. Fails when a file cannot be
/// written. `watch.progress` has the share of this bag.
Result<WrittenBag> write_bag(const RobotToWrite& robot, const std::string& folder, std::int64_t offset_ns,
                             const Watch& watch = {});

/// Writes a mission with source simulation or hall to DIR/alpha, DIR/bravo, .. Robots that were not begun when it was
/// stopped are not among the bags.
Result<std::vector<WrittenBag>> write_bags(const MissionConfig& config, std::uint64_t seed, const std::string& folder,
                                           const Watch& watch = {});

}  // namespace tutti::lab
