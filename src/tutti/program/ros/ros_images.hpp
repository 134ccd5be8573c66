// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/feed_client.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/dds.hpp"
#include "tutti/program/ros/images_intake.hpp"
#include "tutti/program/ros/unstored.hpp"

namespace tutti::ros {

/// Subscribes the cameras and the IMU of a robot once they are published, and feeds what they say. Times are wall time.
class RosImages {
 public:
  struct Options {
    ImagesConfig config;
    bool lossless = false;    ///< RosRobotOptions::lossless
    double patience_s = 5.0;  ///< After so long without cameras, or without what they need, `say` is told so.
    std::function<void(program::Level, const std::string&)> say;
  };
  /// `odometry` and `complaints` must live as long as this.
  RosImages(Options options, std::shared_ptr<Participant> participant, const RosIntake& odometry,
            Complaints& complaints);

  /// Looks for topics, until cameras are subscribed, and takes what has arrived.
  void take();
  /// Fills in cameras and IMU as far as they are known.
  void describe(program::FeedSensors& sensors) const;
  /// Where nothing may be lost: images or IMU samples of the next odometry are still to come. Odometry does not wait
  /// for longer than 5 s of its own time.
  [[nodiscard]] bool holds_odometry() const;
  /// Feeds what odometry up to `stamp` covers to a robot that knows `sensors`. False when the connection has ended.
  bool feed(program::FeedClient& client, const program::FeedSensors& sensors, Timestamp stamp, Unstored& unstored);

 private:
  void look(double now_s);
  Status subscribe(const std::vector<CameraTopics>& cameras, const std::string& imu);

  Options options_;
  std::shared_ptr<Participant> participant_;
  const RosIntake& odometry_;
  Complaints& complaints_;
  std::optional<ImagesIntake> intake_;  ///< Once cameras are subscribed.
  std::vector<std::unique_ptr<Reader>> images_, infos_;
  std::unique_ptr<Reader> imu_;
  std::vector<CameraTopics> seen_;  ///< The cameras that were published when it was looked last.
  std::string seen_imu_, said_;
  double begin_s_, looked_s_ = 0.0;
};

}  // namespace tutti::ros
