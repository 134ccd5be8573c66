// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/ros_encode.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/program/feed/from_robot.hpp"

namespace tutti::program {

/// Turns a robot's answers into messages of ROS 2 (CDR), for the topics and frames of ros2/tutti_ros (docs/ros.md).
class RosAnswers {
 public:
  static constexpr double kTailStep_m = 0.1, kTailStep_rad = 0.1;
  static constexpr std::size_t kLongestTail = 20'000;

  /// `odom` is the odometry's frame. `map` is the map's; when empty it follows from `odom`: "r1/odom" gives "r1/map".
  /// The stamp of map -> odom is set ahead by `tolerance_s`.
  RosAnswers(const std::string& odom, const std::string& map, double tolerance_s);

  void hear(const FeedAnswer& answer, const Pose3& T_odom_body);
  void hear(const FeedTrajectory& trajectory);
  void hear(std::vector<TeamMate> team_mates) { team_mates_ = std::move(team_mates); }
  /// Where the map is in a world. Nothing: not known.
  void hear_world(const std::string& frame, const std::optional<Pose3>& T_world_map) {
    world_ = frame;
    T_world_map_ = T_world_map;
  }

  /// TFMessage with map -> odom, and world -> map once that is known, as of the last answer; nothing when that stamp
  /// was published already, because tf2 warns of repeated ones.
  std::optional<std::string> transform();
  /// TFMessage with world -> map alone, where that has changed since it was published: a robot that stands still, or
  /// has ended, has no odometry that would bring it. Its stamp is a nanosecond later than the one before.
  std::optional<std::string> moved_world();
  /// PoseWithCovarianceStamped: where the body is on the map.
  [[nodiscard]] std::string pose() const;
  /// Path: the trajectory as the map corrects it, followed by the odometry since.
  [[nodiscard]] std::string path() const;
  /// MarkerArray of the team-mates whose place is known.
  [[nodiscard]] std::string team_mates() const;
  /// A PoseStamped for each of these team-mates, keyed by the part of the topic's name that stands for the team-mate.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> team_mate_poses() const;

  [[nodiscard]] const std::string& map_frame() const { return map_; }
  [[nodiscard]] const std::string& odom_frame() const { return odom_; }
  /// True for a transform to the odometry's frame that is one of the last of transform(), as it comes back from /tf,
  /// also with another stamp, which tutti_ros gives it while the robot is silent; and for one from before the first of
  /// these.
  [[nodiscard]] bool may_be_own(const bags::RosTransform& heard) const;

 private:
  /// As transform() and moved_world() publish it.
  [[nodiscard]] bags::RosTransform world_transform(Timestamp stamp) const;

  std::string odom_, map_;
  double tolerance_s_;
  std::optional<FeedAnswer> last_;
  std::optional<Timestamp> said_;
  static constexpr std::size_t kMostOwn = 1'000;
  std::deque<Eigen::Vector3d> own_;  ///< Translations, distinct ones in a row, for may_be_own().
  Timestamp first_own_;
  std::optional<std::pair<std::string, Pose3>> said_world_;
  std::int64_t repeats_ns_ = 0;   // of moved_world() since said_
  Trajectory trajectory_;         ///< T_map_body
  std::deque<StampedPose> tail_;  ///< T_odom_body since the end of trajectory_.
  std::vector<TeamMate> team_mates_;
  std::string world_;
  std::optional<Pose3> T_world_map_;
};

/// The covariance of T_map_body as ROS states it (6x6 by rows; position, then rotation; about the axes of the map),
/// from that of T_map_odom in the right tangent: docs/protocol.md, "The covariance".
std::array<double, 36> ros_covariance(const Matrix6d& of_T_map_odom, const Pose3& T_map_odom, const Pose3& T_map_body);

/// A robot's name, changed to what may be a part of a topic's name.
std::string topic_part(const std::string& name);

}  // namespace tutti::program
