// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tutti/intake/camera_topics.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/live_feed.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// How a robot is connected to topics of ROS 2. Times are wall time.
struct RosRobotOptions {
  std::string name_space;
  std::string odometry = "odom";               ///< Topic of Odometry messages.
  std::string odometry_frames;                 ///< Two frames of /tf instead: "odom->base_link".
  std::string points = "points";               ///< Topic of scans (bags::kScanTypes); empty: none.
  std::string fixes = "fix";                   ///< Topic of NavSatFix messages; empty: no position fixes.
  std::string battery = "battery_state";       ///< Topic of BatteryState messages; empty: none.
  std::optional<intake::ImagesConfig> images;  ///< Nothing: no images and no IMU.
  std::string start_pose = "initialpose";      ///< Topic of PoseWithCovarianceStamped messages; empty: none.
  std::string grid = "/world/map";             ///< Topic of the server's OccupancyGrid; empty: none.
  std::string world_frame = "world";           ///< Empty: world -> map is not published, and no grid taken.
  std::string map_frame;                       ///< Empty: derived from odometry's frame, as RosAnswers does.
  double tolerance_s = 0.1;
  /// For recordings of which nothing may be lost, however fast they are played: requests reliable publishers, waits for
  /// the robot when it is behind, and holds odometry back until the scans before it have arrived.
  bool lossless = false;
  double end_after_s = 0.0;  ///< The recording has ended after so long without odometry; 0: never.
  double patience_s = 5.0;   ///< After so long without odometry, `say` gets a line on it.
  std::string who;           ///< Name and version of this program, for /diagnostics.
  std::function<void(program::Level, const std::string&)> say;
};

/// A robot on ROS 2's topics: a client of the robot's live feed, in a thread of its own, which hands on what others
/// publish and publishes what the robot answers, both as they come, as ros2/tutti_ros does. Destroying it ends the
/// thread.
class RosRobot {
 public:
  /// Fails when topics' names are invalid or cannot be opened.
  static Result<std::unique_ptr<RosRobot>> open(RosRobotOptions options, std::shared_ptr<Participant> participant);
  virtual ~RosRobot() = default;
  /// Begins to feed; to be called once. `feed` must live until end().
  virtual void begin(program::LiveFeed& feed) = 0;
  virtual void end() = 0;

 protected:
  RosRobot() = default;
};

}  // namespace tutti::ros
