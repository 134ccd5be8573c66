// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/intake/images_intake.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/feed_client.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/dds.hpp"
#include "tutti/program/ros/unstored.hpp"

namespace tutti::ros {

/// Subscribes the topics that may be a robot's cameras, their depth and its IMU once they are published, gives up those
/// that turn out to be something else, and feeds what the others say. Times are wall time.
class RosImages {
 public:
  struct Options {
    intake::ImagesConfig config;
    bool lossless = false;  ///< RosRobotOptions::lossless
    /// After so long without cameras, or without what they need, `say` is told so; topics that have said nothing so
    /// long after another are left out.
    double patience_s = 5.0;
    std::function<void(program::Level, const std::string&)> say;
  };
  /// `odometry` and `complaints` must live as long as this.
  RosImages(Options options, std::shared_ptr<Participant> participant, const intake::RosIntake& odometry,
            Complaints& complaints);

  /// Looks for topics, until cameras are subscribed, and takes what has arrived.
  void take();
  /// Fills in cameras and IMU as far as they are known.
  void describe(intake::FeedSensors& sensors) const;
  /// Where nothing may be lost: images or IMU samples of the next odometry are still to come. Odometry does not wait
  /// for longer than 5 s of its own time.
  [[nodiscard]] bool holds_odometry() const;
  /// Feeds what odometry up to `stamp` covers to a robot that knows `sensors`. False when the connection has ended.
  bool feed(program::FeedClient& client, const intake::FeedSensors& sensors, Timestamp stamp, Unstored& unstored);

 private:
  void look(double now_s);
  Status subscribe(const std::vector<intake::CameraTopics>& topics, const std::string& imu);
  void choose(double now_s);

  Options options_;
  std::shared_ptr<Participant> participant_;
  const intake::RosIntake& odometry_;
  Complaints& complaints_;
  std::optional<intake::ImagesIntake> intake_;           ///< Once topics are subscribed.
  std::vector<std::unique_ptr<Reader>> images_, infos_;  ///< By the intake's topics; null: not of use.
  std::unique_ptr<Reader> imu_;
  std::vector<intake::CameraTopics> seen_;  ///< The topics that were published when it was looked last.
  std::vector<intake::CameraTopics> refused_;
  Status why_refused_;  ///< Why cameras could not be chosen, by `refused_`.
  std::string seen_imu_, said_;
  double begin_s_, looked_s_ = 0.0, first_image_s_ = 0.0;
};

}  // namespace tutti::ros
