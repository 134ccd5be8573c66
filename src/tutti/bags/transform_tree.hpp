// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::bags {

/// "/velodyne", as ROS 1 has it, is "velodyne".
std::string frame_name(const std::string& frame);

/// A pose of ROS's: finite, within kMaxCoordinate_m, its quaternion of norm 1 within 0.001, which becomes 1. The error
/// says what it is.
Result<Pose3> to_pose(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation);

/// Where frames of one robot are that do not move against each other: what /tf_static says, and what /tf says of joints
/// that never move.
class TransformTree {
 public:
  /// A pose that is none is an error and changes nothing. Of what is said again of a frame the first counts.
  Status add(const RosTransform& transform, bool is_static);
  /// Maps `from` to `to`; nothing when no chain of transforms leads there.
  [[nodiscard]] std::optional<Pose3> find(const std::string& to, const std::string& from) const;
  /// "base_link, lidar"; for messages.
  [[nodiscard]] std::string frames() const;

 private:
  struct Joint {
    std::string parent;
    Pose3 T_parent_child;
    bool moves = false;
  };
  [[nodiscard]] std::vector<std::pair<std::string, Pose3>> ancestors(const std::string& frame) const;

  std::map<std::string, Joint> joints_;  ///< By child.
};

}  // namespace tutti::bags
