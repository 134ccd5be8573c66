// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tutti/intake/images_intake.hpp"
#include "tutti/intake/ros_intake.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// How a robot is connected to topics of ROS 2. Times are wall time.
struct RosRobotOptions {
  std::string socket;  ///< Path of the robot's live feed.
  std::string name_space;
  std::string odometry = "odom";               ///< Topic of Odometry messages, or two frames of /tf: "odom->base_link".
  std::string points = "points";               ///< Topic of scans (bags::kScanTypes); empty: none.
  std::string fixes = "fix";                   ///< Topic of NavSatFix messages; empty: no position fixes.
  std::string battery = "battery_state";       ///< Topic of BatteryState messages; empty: none.
  std::optional<intake::ImagesConfig> images;  ///< Nothing: no images and no IMU.
  std::string map_frame;                       ///< Empty: derived from odometry's frame, as RosAnswers does.
  double tolerance_s = 0.1;
  /// For recordings of which nothing may be lost, however fast they are played: requests reliable publishers, waits for
  /// the robot when it is behind, and holds odometry back until the scans before it have arrived.
  bool lossless = false;
  double end_after_s = 0.0;  ///< The recording has ended after so long without odometry; 0: never.
  intake::IntakeConfig intake;
  double patience_s = 5.0;  ///< After so long without odometry, `say` is told so.
  std::string who;          ///< Name and version of this program, for /diagnostics.
  std::function<void(program::Level, const std::string&)> say;
};

/// A robot on ROS 2's topics: a client of the robot's live feed, in a thread of its own, which feeds what others
/// publish and publishes what the robot answers, as ros2/tutti_ros does. Destroying it ends the thread.
class RosRobot {
 public:
  /// The socket need not exist yet. Fails when topics' names are invalid or cannot be opened.
  static Result<std::unique_ptr<RosRobot>> open(RosRobotOptions options, std::shared_ptr<Participant> participant);
  virtual ~RosRobot() = default;

 protected:
  RosRobot() = default;
};

}  // namespace tutti::ros
