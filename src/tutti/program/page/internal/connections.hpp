// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace tutti::page {

/// The connections that are served now, so that they can be ended from outside: all of them when the program ends, and
/// the one that has kept the server waiting longest when others want in. May be called from several threads. Times are
/// seconds of any steady clock.
class Connections {
 public:
  /// False: no more are served. `address` is the peer's, without its port.
  bool enter(int socket, std::string address);
  void leave(int socket);  ///< Before the socket is closed.
  /// From `since_s` on the peer is waited for, to speak or to read; nothing: it is served.
  void waits(int socket, std::optional<double> since_s);
  /// Ends a connection whose peer has been waited for at least kPatience_s: of the address that has most of them the
  /// one that has waited longest. Its thread is done soon after. False: there is none.
  bool make_room(double now_s);
  /// Ends all, for good.
  void close();

  static constexpr double kPatience_s = 0.5;

 private:
  struct Connection {
    std::string address;
    std::optional<double> waits_since_s;
    bool is_ended = false;
  };
  static void end(int socket, Connection& connection);

  std::mutex mutex_;
  bool is_closed_ = false;
  std::map<int, Connection> open_;  // by socket
};

}  // namespace tutti::page
