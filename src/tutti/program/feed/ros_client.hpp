// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/intake/sensor_intake.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/ros_answers.hpp"
#include "tutti/program/feed/ros_grid.hpp"

namespace tutti::program {

/// The robot's end for a client that feeds raw messages of ROS (Hello.ros): reads them, and puts what the robot answers
/// into messages that the client publishes as they are. Stamps are the client's own.
class RosClient {
 public:
  /// The type of message by which a client asks for path().
  static constexpr const char* kPathType = "nav_msgs/msg/Path";
  /// The type of message by which a client says where the robot is, as RViz's "2D Pose Estimate" does, and of those
  /// that say it to the client.
  static constexpr const char* kPoseWithCovarianceType = "geometry_msgs/msg/PoseWithCovarianceStamped";

  /// Settings that `ros` leaves open are those of `of_mission`. `newest` is the newest sample that the robot has. Fails
  /// when the topics that it names cannot be those of a robot's cameras.
  static Result<std::unique_ptr<RosClient>> make(intake::SensorConfig of_mission, FeedRos ros,
                                                 const std::optional<Timestamp>& newest);

  /// Fails when the message is not taken; next() has what is due then.
  Status add(const intake::RawMessage& raw);
  /// A start pose, if there is one, and else SensorIntake::next(). Scans are left out while the last answer wanted
  /// none.
  Result<std::optional<Input>> next() {
    if (start_) return std::optional<Input>(*std::exchange(start_, std::nullopt));
    return intake_.next(wants_scan_);
  }
  [[nodiscard]] intake::SensorIntake& intake() { return intake_; }
  [[nodiscard]] const intake::SensorIntake& intake() const { return intake_; }
  /// Whether this client, which comes after `before`, has the same cameras and IMU.
  [[nodiscard]] bool has_sensors_of(const FeedRos& before) const;
  [[nodiscard]] const FeedRos& said() const { return said_; }

  /// The messages that the client is to publish: where the robot is, as transform and pose.
  std::vector<FeedRaw> hear(const FeedAnswer& answer, const Pose3& T_odom_body);
  void hear(const FeedTrajectory& trajectory);
  /// The team-mates, if they are others than before; where the robot is in a map that does not move, if that is newer;
  /// and the grid in the robot's own map, if it is another. `located` is FeedState::located by the client's clock.
  std::vector<FeedRaw> hear(const FeedState& known, Timestamp located);
  /// The whole trajectory; nothing before there is any, and when it is too long for a message.
  [[nodiscard]] std::optional<FeedRaw> path() const;

 private:
  Status take_start_pose(std::string_view cdr);
  /// Said once, where somebody else publishes transforms to the odometry's frame.
  Status look_for_others(const intake::RawMessage& raw);
  std::vector<FeedRaw> team_mates(const std::vector<TeamMate>& team_mates);
  RosClient(intake::IntakeConfig config, FeedRos ros) : said_(std::move(ros)), intake_(std::move(config)) {}

  FeedRos said_;
  intake::SensorIntake intake_;
  std::optional<RosAnswers> answers_;
  std::optional<FeedTrajectory> trajectory_;  ///< Heard before there was any odometry.
  std::vector<TeamMate> team_mates_;
  RosGrid grid_;
  std::optional<StartPose> start_;
  std::optional<Pose3> T_world_map_;  ///< The world is that of the component that this robot is in.
  std::uint32_t component_ = 0;       ///< That one.
  std::string world_;                 ///< Its frame.
  std::optional<Timestamp> located_;  ///< The last one that was published.
  bool wants_scan_ = false;
  int others_ = 0;  ///< Transforms to the odometry's frame that are not this robot's.
};

}  // namespace tutti::program
