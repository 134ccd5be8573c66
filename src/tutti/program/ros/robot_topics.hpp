// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// The topics that a robot publishes (docs/ros.md). A message that cannot be written is complained about.
class RobotTopics {
 public:
  /// `complaints` must live as long as this.
  RobotTopics(std::string name_space, std::shared_ptr<Participant> participant, Complaints& complaints)
      : name_space_(std::move(name_space)), participant_(std::move(participant)), complaints_(complaints) {}
  /// To be called before anything is published.
  Status open();
  /// From now on transforms are published where the robot has a tree of transforms of its own; true the first time.
  bool open_own_tf();

  /// A message of the robot's, on a topic below the namespace.
  void publish(const program::FeedRaw& message);
  /// Somebody would hear it.
  [[nodiscard]] bool is_path_wanted() const { return writers_.at(kPath)->readers() > 0; }
  void publish(const bags::RosDiagnostic& diagnostic, Timestamp now);

 private:
  static constexpr const char *kTf = "/tf", *kPath = "corrected_path", *kDiagnostics = "/diagnostics";
  Status open(const std::string& topic, const std::string& type, const Qos& qos);

  std::string name_space_;
  std::shared_ptr<Participant> participant_;
  Complaints& complaints_;
  std::map<std::string, std::unique_ptr<Writer>> writers_;  ///< By topic, as the robot calls it.
};

}  // namespace tutti::ros
