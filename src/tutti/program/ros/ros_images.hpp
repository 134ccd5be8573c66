// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/local_client.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// Subscribes the topics that may be a robot's cameras, their depth and its IMU once they are published, and gives up
/// those that the robot has no use for. Times are wall time.
class RosImages {
 public:
  struct Options {
    intake::ImagesConfig config;
    bool lossless = false;  ///< RosRobotOptions::lossless
    /// After so long without cameras, or without what they need, `say` gets a line on it.
    double patience_s = 5.0;
    std::function<void(program::Level, const std::string&)> say;
  };
  /// `complaints` must live as long as this.
  RosImages(Options options, std::shared_ptr<Participant> participant, Complaints& complaints);

  /// Finds topics, until cameras are subscribed, and informs the robot which they are; after that, which of them it
  /// uses. To be called often.
  void check_topics(program::LocalClient& client);
  /// Visits everything that is subscribed.
  void take(const std::function<void(Reader&)>& take) const;
  /// The robot must be informed again.
  void begin_again() { readers_.clear(); }

 private:
  void find(program::LocalClient& client, double now_s);
  Status subscribe(const std::vector<intake::CameraTopics>& topics, const std::string& imu);
  void give_up(program::LocalClient& client, double now_s);

  Options options_;
  std::shared_ptr<Participant> participant_;
  Complaints& complaints_;
  std::vector<std::unique_ptr<Reader>> readers_;
  std::vector<intake::CameraTopics> seen_;  ///< The topics that were published at the last check.
  std::vector<intake::CameraTopics> refused_;
  std::string seen_imu_, said_;
  double begin_s_, checked_s_ = 0.0;
};

}  // namespace tutti::ros
