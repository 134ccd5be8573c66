// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

/// What is known of a mission or a map, as viewers of robots' recordings show it.
namespace tutti::exports {

/// One file for all: names are ROS's, without a leading slash ("alpha/server"); stamps are of one clock.
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
    std::string name, state, reason;  ///< State: accepted, rejected, candidate.
    bool between_robots = false;
    std::string frame;
    Timestamp stamp;  ///< Of its later end.
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    std::vector<std::pair<std::string, double>> numbers;  ///< Of a kind that all have, or none.
  };
  struct Alert {
    Timestamp stamp;
    bool is_error = false;
    std::string name, message;
    std::vector<std::pair<std::string, std::string>> values;
  };
  /// Numbers of a moment; those of one topic have the same names.
  struct Numbers {
    std::string topic;
    Timestamp stamp;
    std::vector<std::pair<std::string, double>> values;
  };

  std::vector<Track> tracks;
  std::vector<Transform> still;
  std::vector<Motion> motions;
  std::vector<Cloud> clouds;
  std::vector<Closure> closures;
  std::vector<Alert> alerts;
  std::vector<Numbers> numbers;
};

struct WrittenScene {
  std::size_t messages = 0, topics = 0;
};

/// As an MCAP file that Foxglove, Rerun and PlotJuggler open. What holds for all the time (ways as nav_msgs/Path,
/// clouds, closures as lines of MarkerArrays by their state, /tf_static) stands at the first stamp, what moves (/tf,
/// each way once more as PoseStamped, numbers and closures as JSON, alerts in /diagnostics) at its own. Nothing in the
/// scene has a stamp: an error. Stamps before 1970 are moved, all by the same, to begin there.
Result<WrittenScene> write_scene(const Scene& scene, const std::string& path);

/// A part of a topic's or frame's name: what ROS does not allow in it becomes '_'.
std::string ros_name(std::string name);

}  // namespace tutti::exports
