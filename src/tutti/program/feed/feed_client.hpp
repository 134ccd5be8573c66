// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tutti/program/feed/feed_frames.hpp"

namespace tutti::v1 {
class Feed;
}

/// The driver's end of a live feed: what feeds a robot program odometry, scans, images and IMU samples.
namespace tutti::program {

/// What a robot answers (proto/tutti/v1/feed.proto), reduced to the fields that the drivers here need. Poses are
/// `T_a_b` in metres; stamps are the client's own.
struct FeedWelcome {
  std::string robot;
  std::optional<Timestamp> newest;  ///< The newest sample that the robot has; feeding goes on behind it.
  Pose3 T_map_odom;
};
struct FeedAnswer {
  Timestamp stamp;
  bool wants_scan = false;          ///< A scan at or after this sample would be used.
  std::optional<Timestamp> stored;  ///< The newest sample that the robot has on its disk.
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
  bool in_map = false;
  std::vector<TeamMate> team_mates;
  std::vector<std::string> alerts;
  std::vector<std::pair<std::string, std::string>> status;  ///< FeedState::status
};
/// The answer to say_time().
struct FeedProgress {
  std::optional<Timestamp> stored;
};
/// The robot ends the connection.
struct FeedOver {
  std::string why;
};
/// A message that drivers here do not need.
struct FeedOther {};
using FromRobot = std::variant<FeedWelcome, FeedAnswer, FeedProgress, FeedJump, FeedSituation, FeedRefusal, FeedWay,
                               FeedEnd, FeedOver, FeedOther>;

/// A connection that feeds a robot. Not for several threads at a time. `say` returns once the message is written to the
/// socket, and fails when the connection has ended; answers are read with hear().
class FeedClient {
 public:
  /// Connects and sends Hello; the robot's FeedWelcome is what hear() returns first. Fails when nobody listens on
  /// `socket`.
  static Result<std::unique_ptr<FeedClient>> connect(const std::string& socket, const std::string& name,
                                                     const intake::FeedSensors& sensors, bool wants_way);
  ~FeedClient();
  FeedClient(const FeedClient&) = delete;
  FeedClient& operator=(const FeedClient&) = delete;

  Status say(const node::OdometrySample& sample);
  Status say(const Scan& scan);
  Status say(const intake::FedImages& images);
  Status say(const std::vector<ImuSample>& samples);
  Status say(const PositionFix& fix);
  Status say(const Health& health);
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
