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

/// The other end of a live feed: a driver's.
namespace tutti::program {

/// What a robot says, as far as a driver needs it that does not drive by it.
struct FeedWelcome {
  std::string robot;
  std::optional<Timestamp> newest;  ///< The feed goes on after it.
};
struct FeedAnswer {
  Timestamp stamp;
  bool wants_scan = false;
  std::optional<Timestamp> stored;  ///< So far the robot has got.
};
/// To say_time().
struct FeedProgress {
  std::optional<Timestamp> stored;
};
struct FeedOver {
  std::string why;
};
struct FeedOther {};
using FromRobot =
    std::variant<FeedWelcome, FeedAnswer, FeedProgress, FeedRefusal, FeedWay, FeedEnd, FeedOver, FeedOther>;

/// A connection that feeds. Calls wait for the robot; it answers at once.
class FeedClient {
 public:
  /// Connects, and says hello; hear() brings the FeedWelcome.
  static Result<std::unique_ptr<FeedClient>> connect(const std::string& socket, const std::string& name,
                                                     const FeedSensors& sensors, bool wants_way);
  ~FeedClient();
  FeedClient(const FeedClient&) = delete;
  FeedClient& operator=(const FeedClient&) = delete;

  Status say(const node::OdometrySample& sample);
  Status say(const Scan& scan);
  Status say(const FedImages& images);
  Status say(const std::vector<ImuSample>& samples);
  /// Asks how far the robot has got; says nothing of a clock that anybody could use.
  Status say_time();
  Status say_end();
  /// The next message, waiting for it at most so long; nothing: there was none. An error: the connection has ended.
  Result<std::optional<FromRobot>> hear(int timeout_ms);

 private:
  explicit FeedClient(int file) : file_(file) {}
  Status send(const v1::Feed& message);

  int file_;
  FrameReader reader_;
  std::string unread_;
};

}  // namespace tutti::program
