// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/robot_topics.hpp"

#include <span>
#include <utility>

#include "tutti/bags/ros_definitions.hpp"

namespace tutti::ros {

Status RobotTopics::open() {
  struct Topic {
    std::unique_ptr<Writer>& out;
    const char *name, *type;
    Qos qos;
  };
  for (const Topic& topic : {Topic{tf_, "/tf", kTfType, kTfQos},
                             {pose_, "corrected_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", {}},
                             {path_, "corrected_path", "nav_msgs/msg/Path", kLatchedQos},
                             {mates_, "team_mates", "visualization_msgs/msg/MarkerArray", kLatchedQos},
                             {diagnostics_, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", {}}}) {
    auto made = writer(topic.name, topic.type, topic.qos);
    if (!made) return tl::unexpected(made.error());
    topic.out = std::move(*made);
  }
  return {};
}

bool RobotTopics::open_own_tf() {
  if (own_tf_) return false;
  auto made = writer("tf", kTfType, kTfQos);
  if (!made) {
    complaints_.add("tf", tl::unexpected(made.error()));
    return false;
  }
  own_tf_ = std::move(*made);
  return true;
}

Result<std::unique_ptr<Writer>> RobotTopics::writer(const std::string& topic, const std::string& type, const Qos& qos) {
  const auto name = resolve(topic, name_space_);
  if (!name) return tl::unexpected(name.error());
  return participant_->writer(*name, type, qos, bags::ros_type_hash(type));
}

void RobotTopics::publish_pose(program::RosAnswers& answers) {
  if (const auto transform = answers.transform())
    complaints_.add("map -> odom", (own_tf_ ? own_tf_ : tf_)->write(*transform));
  complaints_.add("corrected_pose", pose_->write(answers.pose()));
}

bool RobotTopics::publish_path(const program::RosAnswers& answers) {
  if (path_->readers() == 0) return false;
  complaints_.add("corrected_path", path_->write(answers.path()));
  return true;
}

void RobotTopics::publish_team_mates(const program::RosAnswers& answers) {
  complaints_.add("team_mates", mates_->write(answers.team_mates()));
  for (const auto& [name, cdr] : answers.team_mate_poses()) {
    std::unique_ptr<Writer>& out = mate_poses_[name];
    if (!out) {
      auto made = writer("team_mates/" + name + "/pose", "geometry_msgs/msg/PoseStamped", kLatchedQos);
      if (!made) return complaints_.add("team_mates", tl::unexpected(made.error()));
      out = std::move(*made);
    }
    complaints_.add("team_mates", out->write(cdr));
  }
}

void RobotTopics::publish(const bags::RosDiagnostic& diagnostic, Timestamp now) {
  complaints_.add("/diagnostics", diagnostics_->write(bags::encode({now, ""}, std::span(&diagnostic, 1))));
}

}  // namespace tutti::ros
