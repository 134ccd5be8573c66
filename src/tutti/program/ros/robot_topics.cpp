// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/robot_topics.hpp"

#include <span>
#include <utility>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/program/feed/ros_client.hpp"

namespace tutti::ros {

Status RobotTopics::open() {
  struct Topic {
    const char *name, *type;
    Qos qos;
  };
  for (const auto& [name, type, qos] : {Topic{kTf, bags::kTfType, kTfQos},
                                        {"corrected_pose", program::RosClient::kPoseWithCovarianceType, {}},
                                        {"localised_pose", program::RosClient::kPoseWithCovarianceType, {}},
                                        {kPath, "nav_msgs/msg/Path", kLatchedQos},
                                        {"team_mates", "visualization_msgs/msg/MarkerArray", kLatchedQos},
                                        {kDiagnostics, "diagnostic_msgs/msg/DiagnosticArray", {}}})
    if (Status ok = open(name, type, qos); !ok) return ok;
  return {};
}

Status RobotTopics::open(const std::string& topic, const std::string& type, const Qos& qos) {
  const auto name = resolve(topic, name_space_);
  if (!name) return tl::unexpected(name.error());
  auto made = participant_->writer(*name, type, qos, bags::ros_type_hash(type));
  if (!made) return tl::unexpected(made.error());
  writers_[topic] = std::move(*made);
  return {};
}

bool RobotTopics::open_own_tf() {
  constexpr const char* kOwnTf = "tf";
  if (writers_.contains(kOwnTf)) return false;
  const Status ok = open(kOwnTf, bags::kTfType, kTfQos);
  complaints_.add(kOwnTf, ok);
  if (ok) std::swap(writers_[kTf], writers_[kOwnTf]);  // the other one stays open
  return ok.has_value();
}

void RobotTopics::publish(const program::FeedRaw& message) {
  if (!writers_.contains(message.topic))  // one for each team-mate
    if (const Status ok = open(message.topic, message.type, kLatchedQos); !ok)
      return complaints_.add(message.topic, ok);
  complaints_.add(message.topic, writers_.at(message.topic)->write(message.bytes));
}

void RobotTopics::publish(const bags::RosDiagnostic& diagnostic, Timestamp now) {
  complaints_.add(kDiagnostics, writers_.at(kDiagnostics)->write(bags::encode({now, ""}, std::span(&diagnostic, 1))));
}

}  // namespace tutti::ros
