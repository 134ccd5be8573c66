// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tutti/program/feed/feed_frames.hpp"

namespace tutti::program {

/// A robot's answers (proto/tutti/v1/feed.proto), reduced to the fields that the drivers here need. Poses are
/// `T_a_b` in metres; stamps are the client's own.
struct FeedWelcome {};
struct FeedAnswer {
  Timestamp stamp;
  bool wants_scan = false;  ///< A scan at or after this sample would be used.
  Pose3 T_map_body, T_map_odom;
  Matrix6d covariance = Matrix6d::Zero();           ///< T_map_odom's, right tangent.
  std::pair<std::uint64_t, std::uint64_t> map_age;  ///< ProxyGraph::age() of the newest map heard: epoch, revision.
  bool in_map = false;                              ///< The map knows this robot's chain.
};
struct FeedJump {
  double translation_m = 0.0;
  std::string why;
};
struct FeedSituation {
  std::vector<std::string> alerts;
  std::vector<std::pair<std::string, std::string>> status;  ///< FeedState::status
};
/// The robot ends the connection.
struct FeedOver {
  std::string why;
};
/// For people: how the robot reads what it is fed.
struct FeedNote {
  std::string text;
};
/// A message that drivers here do not need.
struct FeedOther {};
using FromRobot =
    std::variant<FeedWelcome, FeedAnswer, FeedJump, FeedSituation, FeedRefusal, FeedOver, FeedRaw, FeedNote, FeedOther>;
/// Decodes a message of the robot; an error when it is none.
Result<FromRobot> decode_from_robot(const std::string& payload);

}  // namespace tutti::program
