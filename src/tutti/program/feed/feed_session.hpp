// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/program/feed/feed_clock.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/feed_settings.hpp"
#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/smooth_map.hpp"

namespace tutti::program {

/// The live feed of one robot, without sockets: bytes of clients in, bytes to them out. One client feeds, the others
/// listen. A client that does not read holds up nobody: beyond FeedSettings::max_queue_kb it loses the oldest
/// corrections (and is told how many), and when what cannot be left out alone is more, its connection.
class FeedSession {
 public:
  using Client = std::uint64_t;
  /// The robot's time now, since the Unix epoch.
  using Now = std::function<Timestamp()>;
  /// `target` outlives it. Corrections begin with the target's T_map_odom of now.
  FeedSession(
      FeedTarget& target, const FeedSettings& settings, Now now = [] { return Timestamp{}; });

  void connect(Client client) { clients_[client]; }
  /// Whoever feeds may come again, or another; the robot goes on where it stood.
  void disconnect(Client client);
  /// Carries out every message that is whole now.
  void receive(Client client, std::string_view bytes);
  /// The robot may have heard or done something: says so to those who listen, if it matters to them.
  void refresh();

  /// What is to be written next; empty: nothing.
  [[nodiscard]] std::string_view output(Client client) const;
  /// So many bytes of output() were.
  void sent(Client client, std::size_t bytes);
  /// Nothing more is to be read from this client; with no output() left, the connection ends.
  [[nodiscard]] bool is_over(Client client) const { return clients_.at(client).over; }
  /// It has said who it is.
  [[nodiscard]] bool is_greeted(Client client) const { return clients_.at(client).greeted; }
  /// It has said all, and the answer to that is still to come.
  [[nodiscard]] bool waits_for_end(Client client) const { return clients_.at(client).waits_for_end; }
  [[nodiscard]] bool has_feeder() const { return feeder_.has_value(); }
  /// Of whoever feeds, or did last.
  struct Feeder {
    std::string name;
    FeedClock clock;
    std::uint64_t bytes = 0;  ///< That all who fed have said.
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
    std::size_t queued = 0;     ///< Bytes, those of the first frame that were sent among them.
    std::size_t sent = 0;       ///< Of the first frame.
    std::uint64_t dropped = 0;  ///< Corrections.
    bool greeted = false;
    bool over = false;
    bool ended = false;          ///< It said that the recording has,
    bool waits_for_end = false;  ///< and is not answered yet.
    bool listens_only = false;
    bool wants_way = false;
  };

  void close(Client client, const std::string& why);
  void put(Connection& connection, std::string frame, bool is_correction = false);
  void make_room(Connection& connection);
  /// To all that were greeted, by the clock of each (FeedClock::offset_ns()).
  void broadcast(const std::function<std::string(std::int64_t offset_ns)>& frame);
  [[nodiscard]] std::int64_t offset_ns(Client client) const { return feeder_ == client ? last_.clock.offset_ns() : 0; }
  void refuse(Client client, Timestamp stamp, const std::string& why);
  void take(Client client, FromClient message);
  void take_fed(Client client, FromClient message);
  void take_time(Client client, const FeedTime& time);
  void greet(Client client, const FeedHello& hello);
  void answer_end();
  void take_odometry(Client client, const node::OdometrySample& sample);

  FeedTarget& target_;
  FeedSettings settings_;
  SmoothMap map_;
  Pose3 T_odom_fed_;       ///< Of map_: changes where the client's odometry jumps.
  std::string situation_;  ///< The frame that was last told.
  std::map<Client, Connection> clients_;
  std::optional<Client> feeder_;
  Feeder last_;
  Now now_;
};

}  // namespace tutti::program
