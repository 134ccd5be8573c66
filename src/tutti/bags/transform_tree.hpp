// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::bags {

/// The frame's name without ROS 1's leading slash: "/velodyne" is "velodyne".
std::string frame_name(const std::string& frame);

/// A pose from a message: finite, within kMaxCoordinate_m, with a quaternion of norm 1 within kUnitTolerance, which is
/// normalised. Errors have the value.
Result<Pose3> to_pose(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation);

/// True if the quaternion's norm differs from 1 by more than rounding leaves.
bool is_scaled(const Eigen::Quaterniond& rotation);

/// Doubts a sensor that is more than 10 m away from the body: "800.0 m from .., as if in millimetres"; else empty.
std::string doubt_of_place(const Pose3& T_body_sensor);

/// Poses between those frames of one robot that do not move against each other: the transforms of /tf_static, and those
/// of /tf that never change.
class TransformTree {
 public:
  /// Adds a transform; one that to_pose() refuses is an error and changes nothing. The first of several transforms of
  /// one child frame counts; if a later one of /tf (not `is_static`) differs by 1 mm, 1 mrad or its parent, the frame
  /// moves, and find() does not go through it. Transforms that contradict each other are an error, too, with both: of
  /// one frame in two parents, and of a frame that is static and differs.
  Status add(const RosTransform& transform, bool is_static);
  /// Adds the frames of another tree that are not known yet, and its problems.
  void merge(const TransformTree& other);
  /// Errors of add(), each with how often it came.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& problems() const { return problems_; }
  void add_problem(const std::string& problem, std::uint64_t count = 1);
  /// T_to_from, or no value when no chain of transforms that do not move joins the two frames.
  [[nodiscard]] std::optional<Pose3> find(const std::string& to, const std::string& from) const;
  /// The same; the error has both frames and those that do not move. `where` is what has the transforms: " on /tf".
  [[nodiscard]] Result<Pose3> pose(const std::string& to, const std::string& from, const char* where = "") const;
  /// The frame at the end of the chain of transforms that do not move, from `frame` up; `frame` itself if it has none.
  [[nodiscard]] std::string root_of(const std::string& frame) const;
  /// All frames that do not move, "base_link, lidar", for messages.
  [[nodiscard]] std::string frames() const;

 private:
  struct Joint {
    std::string parent;
    Pose3 T_parent_child;
    bool is_static = false, moves = false;
  };
  [[nodiscard]] static Status check_agrees(const std::string& child, const Joint& first, const Joint& later);
  [[nodiscard]] std::vector<std::pair<std::string, Pose3>> ancestors(const std::string& frame) const;

  Status take(const RosTransform& transform, bool is_static);

  std::map<std::string, Joint> joints_;  ///< By child.
  std::map<std::string, std::uint64_t> problems_;
};

}  // namespace tutti::bags
