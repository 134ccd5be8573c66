// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tutti/program/feed/from_robot.hpp"
#include "tutti/program/feed/live_feed.hpp"

namespace tutti::program {

/// A client of a live feed in the robot's own process: what it sends is taken at once, and copied nowhere. Not for
/// several threads at a time.
class LocalClient {
 public:
  /// `feed` must outlive the client. Fails when it takes no clients just then; when it refuses this one, hear() reports
  /// why.
  static Result<std::unique_ptr<LocalClient>> join(LiveFeed& feed, const FeedHello& hello);
  ~LocalClient();
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;

  void say(const intake::RawMessage& message);
  void say(FeedEnd end);
  /// Uses what reads the messages of this client, then takes the inputs that are due.
  void use_intake(const std::function<void(intake::SensorIntake&)>& work);
  /// The robot's messages since the last call. An error when the connection has ended.
  Result<std::vector<FromRobot>> hear();

 private:
  explicit LocalClient(LiveFeed& feed) : feed_(feed) {}
  void use(const std::function<void(FeedSession&)>& work);

  LiveFeed& feed_;
  std::uint64_t server_ = 0;
  FeedSession::Client client_ = 0;
  bool has_ended_ = false;
};

}  // namespace tutti::program
