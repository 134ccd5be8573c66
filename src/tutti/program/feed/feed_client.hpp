// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/from_robot.hpp"

namespace tutti::v1 {
class Feed;
}

/// The driver's end of a live feed: what feeds a robot program odometry, scans, images and IMU samples.
namespace tutti::program {

/// A connection that feeds a robot. Not for several threads at a time. `say` returns once the message is written to the
/// socket, and fails when the connection has ended; answers are read with hear().
class FeedClient {
 public:
  /// Connects and sends Hello; the robot's FeedWelcome is what hear() returns first. Fails when nobody listens on
  /// `socket`.
  static Result<std::unique_ptr<FeedClient>> connect(const std::string& socket, const std::string& name,
                                                     const Sensors& sensors, bool wants_trajectory);
  ~FeedClient();
  FeedClient(const FeedClient&) = delete;
  FeedClient& operator=(const FeedClient&) = delete;

  Status say(const Input& input);
  /// Asks which sample the robot has stored by now. The clock value in the message is a dummy, so do not use it to
  /// measure an offset.
  Status say_time();
  Status say_end();
  /// The next message, or nothing when none came within `timeout_ms`. An error means that the connection has ended.
  Result<std::optional<FromRobot>> hear(int timeout_ms);

 private:
  explicit FeedClient(int file) : file_(file) {}
  Status send(const v1::Feed& message);

  int file_;
  FrameReader reader_;
  std::string unread_;
};

}  // namespace tutti::program
