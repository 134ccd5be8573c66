// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/geometry/geodesy.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

/// A mission or a map as an MCAP file for viewers of robots' recordings.
namespace tutti::exports {

/// The contents of the file. Names of topics and frames are ROS's, without a leading slash ("alpha/server"); all stamps
/// are of one clock.
struct Scene {
  struct Track {
    std::string topic, frame;
    Trajectory poses;
  };
  struct Transform {
    std::string parent, child;
    Pose3 T_parent_child;
  };
  /// A frame that moves: T_parent_child.
  struct Motion {
    std::string parent, child;
    Trajectory poses;
  };
  struct Cloud {
    std::string topic, frame;
    PointCloud cloud;
  };
  struct Closure {
    std::string name, state, reason;  ///< `state`: accepted, rejected or candidate.
    bool between_robots = false;
    std::string frame;
    Timestamp stamp;  ///< Stamp of its later end.
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    std::vector<std::pair<std::string, double>> numbers;  ///< Either all closures have the same names or none has any.
  };
  struct Alert {
    Timestamp stamp;
    bool is_error = false;
    std::string name, message;
    std::vector<std::pair<std::string, std::string>> values;
  };
  /// Numbers that belong to a time; all of one topic have the same names.
  struct Numbers {
    std::string topic;
    Timestamp stamp;
    std::vector<std::pair<std::string, double>> values;
  };

  /// Where the origin of the frame `enu` is on the earth, and where the map is in `enu`.
  struct Earth {
    Geodetic origin;
    std::string frame;  ///< A frame of the map.
    Pose3 T_enu_frame;  ///< Pose of that frame in `enu`.
  };

  std::vector<Track> tracks;
  std::vector<Transform> still;
  std::vector<Motion> motions;
  std::vector<Cloud> clouds;
  std::vector<Closure> closures;
  std::vector<Alert> alerts;
  std::vector<Numbers> numbers;
  std::optional<Earth> earth;
};

/// Counts of what write_scene() has written.
struct WrittenScene {
  std::size_t messages = 0, topics = 0;
};

/// Writes an MCAP file that Foxglove, Rerun and PlotJuggler open. Data that are true all the time (trajectories as
/// nav_msgs/Path, clouds, closures as lines of one MarkerArray per state, /tf_static, the origin of `enu`) are written
/// at the first stamp; what moves (/tf, each trajectory once more as PoseStamped and, in the earth's frame, as
/// NavSatFix, numbers and closures as JSON, alerts in /diagnostics) at its own. If there are stamps before 1970, all
/// stamps are moved so that the first is at 1970. A scene without any stamp is an error.
/// With `ros_only` every message is one of ROS, as rosbag2 needs it, which plays no file with a channel of JSON:
/// numbers and closures are diagnostic_msgs/DiagnosticArray on the same topics then.
Result<WrittenScene> write_scene(const Scene& scene, const std::string& path, bool ros_only = false);

/// A part of a topic's or frame's name that ROS allows: other letters become '_', and a name that is empty or begins
/// with a digit gets "robot_" in front.
std::string ros_name(std::string name);

}  // namespace tutti::exports
