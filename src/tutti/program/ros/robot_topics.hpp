// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/program/feed/ros_answers.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// What a robot publishes (docs/ros.md). What cannot be written is complained about.
class RobotTopics {
 public:
  /// `complaints` must live as long as this.
  RobotTopics(std::string name_space, std::shared_ptr<Participant> participant, Complaints& complaints)
      : name_space_(std::move(name_space)), participant_(std::move(participant)), complaints_(complaints) {}
  /// To be called before anything is published.
  Status open();
  /// From now on map -> odom is published where the robot has a tree of transforms of its own; true the first time.
  bool open_own_tf();

  /// map -> odom, unless its stamp was published already, and the pose on the map.
  void publish_pose(program::RosAnswers& answers);
  /// False when nobody would hear it.
  bool publish_path(const program::RosAnswers& answers);
  void publish_team_mates(const program::RosAnswers& answers);
  void publish(const bags::RosDiagnostic& diagnostic, Timestamp now);

 private:
  Result<std::unique_ptr<Writer>> writer(const std::string& topic, const std::string& type, const Qos& qos);

  std::string name_space_;
  std::shared_ptr<Participant> participant_;
  Complaints& complaints_;
  std::unique_ptr<Writer> tf_, own_tf_, pose_, path_, mates_, diagnostics_;
  std::map<std::string, std::unique_ptr<Writer>> mate_poses_;
};

}  // namespace tutti::ros
