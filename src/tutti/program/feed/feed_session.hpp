// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/program/feed/feed_clock.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/feed_settings.hpp"
#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/ros_client.hpp"
#include "tutti/program/feed/smooth_map.hpp"

namespace tutti::program {

/// The live feed of one robot, without sockets: takes bytes from clients and gives bytes for them. One client feeds,
/// the others listen. A client that does not read holds up nobody: beyond FeedSettings::max_queue_kb it loses its
/// oldest corrections (and learns how many); when the messages that must not be dropped alone exceed that, it is
/// disconnected. Incomplete frames take at most kMaxFeedBytes for the client that feeds, and kMaxHelloBytes for each
/// other one.
class FeedSession {
 public:
  using Client = std::uint64_t;
  /// Returns the robot's time, since the Unix epoch.
  using Now = std::function<Timestamp()>;
  /// `target` must outlive the session. Corrections start from the target's T_map_odom at this time.
  /// Raw messages are read as in `sensors`, unless their client states otherwise.
  FeedSession(
      FeedTarget& target, const FeedSettings& settings, Now now = [] { return Timestamp{}; },
      intake::SensorConfig sensors = {});

  void connect(Client client) { clients_[client]; }
  /// A client that feeds may come again, or another one may take over; the robot goes on where it stood.
  void disconnect(Client client);
  /// Handles every message that `bytes` complete.
  void receive(Client client, std::string_view bytes);
  // For a client of this process (LocalClient), which passes values.
  void say(Client client, const FeedHello& hello) { greet(client, hello); }
  void say(Client client, FeedEnd end) { take(client, end); }
  void say(Client client, const intake::RawMessage& raw) {
    last_.bytes += raw.bytes.size();
    take_raw(client, raw);
  }
  /// The reader of the feeding client's raw messages; null for a client that feeds none. After it has got something,
  /// take_due() is to be called.
  [[nodiscard]] RosClient* ros() { return ros_.get(); }
  /// Takes the inputs that are due of the raw messages so far.
  void take_due(Client client);
  /// Ends connections in which a frame has begun, or the last messages wait, and nothing goes on for kMostPause_s. To
  /// be called now and then; `wall_s` is of a clock that never goes back.
  void close_stalled(double wall_s);
  static constexpr double kMostPause_s = 60.0;
  /// To be called when the robot may have heard or done something: reports to clients what has changed for them.
  void refresh();

  /// The bytes to write to this client next; empty when there are none.
  [[nodiscard]] std::string_view output(Client client) const;
  /// Notes that the first `bytes` of output() were written.
  void sent(Client client, std::size_t bytes);
  /// Nothing more is to be read from this client; once output() is empty, close its connection.
  [[nodiscard]] bool is_over(Client client) const { return clients_.at(client).over; }
  /// The client has sent Hello.
  [[nodiscard]] bool is_greeted(Client client) const { return clients_.at(client).greeted; }
  /// The client has ended the recording, and the answer to that is still to come.
  [[nodiscard]] bool waits_for_end(Client client) const { return clients_.at(client).waits_for_end; }
  [[nodiscard]] bool has_feeder() const { return feeder_.has_value(); }
  /// The client that feeds, or fed last.
  struct Feeder {
    std::string name;
    FeedClock clock;
    std::uint64_t bytes = 0;  ///< Received from all clients that fed.
  };
  [[nodiscard]] const Feeder& feeder() const { return last_; }

 private:
  struct Frame {
    std::string bytes;
    bool is_correction = false;
  };
  struct Connection {
    FrameReader reader;
    std::deque<Frame> queue;
    std::size_t queued = 0;     ///< Bytes in the queue, including those of the first frame that were already sent.
    std::size_t sent = 0;       ///< Bytes of the first frame that were sent.
    std::uint64_t dropped = 0;  ///< Corrections that were dropped.
    bool moved = false;         ///< Bytes came or left since close_stalled() was called last.
    double moved_s = 0.0;       ///< When it saw that last.
    bool greeted = false;
    bool over = false;
    bool ended = false;          ///< It has ended the recording,
    bool waits_for_end = false;  ///< and that is not answered yet.
    bool listens_only = false;
    bool wants_trajectory = false;
  };

  void close(Client client, const std::string& why);
  void put(Connection& connection, std::string frame, bool is_correction = false);
  void make_room(Connection& connection);
  static void drop_queue(Connection& connection);
  /// Sends a frame to every greeted client, with stamps by the clock of each (FeedClock::offset_ns()).
  void broadcast(const std::function<std::string(std::int64_t offset_ns)>& frame);
  [[nodiscard]] std::int64_t offset_ns(Client client) const { return feeder_ == client ? last_.clock.offset_ns() : 0; }
  void refuse(Client client, Timestamp stamp, const std::string& why);
  void take(Client client, FromClient message);
  void take_fed(Client client, Input input);
  void take_time(Client client, const FeedTime& time);
  void greet(Client client, const FeedHello& hello);
  void answer_end();
  /// After a sample of odometry was taken of this client.
  void answer(Client client);
  // For a client that feeds raw messages: feed_session_ros.cpp.
  Status begin_ros(const FeedHello& hello);
  void take_raw(Client client, const intake::RawMessage& raw);
  void send_to_ros(Client client, const FeedState& state, const SmoothMap::Answer& answer);
  void send_to_ros(FeedTrajectory trajectory);
  [[nodiscard]] Timestamp by_client(Timestamp stamp) const;
  /// The target's, with what this session knows itself.
  [[nodiscard]] FeedState state() const;

  FeedTarget& target_;
  FeedSettings settings_;
  SmoothMap map_;
  Pose3 T_odom_fed_;       ///< FeedState::T_odom_fed as of `map_`; it changes where the client's odometry jumps.
  std::string situation_;  ///< The situation's frame as sent last, without its status,
  decltype(FeedState::status) status_;  ///< which is this.
  std::map<Client, Connection> clients_;
  std::optional<Client> feeder_;
  Feeder last_;
  Now now_;
  const intake::SensorConfig of_mission_;
  std::unique_ptr<RosClient> ros_;     ///< Belongs to the client that feeds, if raw messages.
  Sensors sensors_;                    ///< As the target got them last,
  std::optional<FeedRos> sensors_of_;  ///< by a client that sent this.
};

}  // namespace tutti::program
