// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
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
  /// A newcomer, who is waited for from now on. Where his address has its share, or all have theirs, he takes the place
  /// of one whose peer is waited for: of the address that has most of them the one that has waited longest; its thread
  /// is done soon after. False: there is none, or no more are served. `address` is the peer's, without its port.
  bool enter(int socket, std::string address, double now_s);
  void leave(int socket);  ///< Before the socket is closed.
  /// From `since_s` on the peer is waited for, to speak or to read; nothing: it is served.
  void waits(int socket, std::optional<double> since_s);
  /// Ends all, for good.
  void close();

  static constexpr std::size_t kMost = 256, kMostOfAddress = 16;
  static constexpr std::size_t kThreads = kMost + 32;  ///< With those that are being ended.

 private:
  struct Connection {
    std::string address;
    std::optional<double> waits_since_s;
    bool is_ended = false;
  };
  /// Ends one whose peer is waited for, of this address or of any. False: there is none.
  bool make_room(double now_s, const std::optional<std::string>& of);
  static void end(int socket, Connection& connection);

  std::mutex mutex_;
  bool is_closed_ = false;
  std::map<int, Connection> open_;  // by socket
};

}  // namespace tutti::page
