// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <poll.h>

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tutti/program/feed/feed_session.hpp"

namespace tutti::program {

/// Who may connect to a feed's socket, beside root.
struct FeedAccess {
  std::string group;     ///< Group that owns the socket; empty: the program's own.
  unsigned mode = 0600;  ///< File mode of the socket.
};

/// Serves a FeedSession on a Unix socket. It has no thread of its own: its program calls serve() repeatedly, which may
/// be where the program waits.
class FeedServer {
 public:
  /// Listens at `path` with `access`. A socket left there by a killed program is replaced; fails when another program
  /// listens on it, or when the path is another kind of file. `target` must outlive the server; `sensors` is
  /// FeedSession's.
  static Result<std::unique_ptr<FeedServer>> listen(const std::string& path, FeedTarget& target,
                                                    const FeedSettings& settings, const FeedAccess& access = {},
                                                    intake::SensorConfig sensors = {});
  ~FeedServer();
  FeedServer(const FeedServer&) = delete;
  FeedServer& operator=(const FeedServer&) = delete;

  /// Waits at most `timeout_ms` (0: not at all) for something to do, then does all that can be done without waiting.
  void serve(int timeout_ms);
  /// The parts of serve(), for a program that uses the session elsewhere while this waits: what to wait for,
  struct Waiting {
    std::vector<pollfd> files;                 ///< The one that listens, then those of the clients.
    std::vector<FeedSession::Client> clients;  ///< One for each file but the first.
  };
  [[nodiscard]] Waiting begin();
  /// waiting for it, false when it was interrupted,
  static bool wait(Waiting& waiting, int timeout_ms);
  /// and doing what can be done.
  void finish(const Waiting& waiting);
  [[nodiscard]] FeedSession& session() { return session_; }
  /// A client of this process, which the session alone knows.
  FeedSession::Client join() {
    session_.connect(next_);
    return next_++;
  }
  [[nodiscard]] std::size_t clients() const { return files_.size(); }

 private:
  FeedServer(std::string path, int listener, FeedTarget& target, const FeedSettings& settings,
             intake::SensorConfig sensors);
  void accept_one();
  /// Drops the oldest connection that has not sent Hello; false when there is none.
  bool drop_silent();
  /// Each is false when the connection has ended.
  bool read_from(FeedSession::Client client, int file);
  bool write_to(FeedSession::Client client, int file);
  void drop(FeedSession::Client client);

  std::string path_;
  int listener_ = -1;
  FeedSettings settings_;
  FeedSession session_;
  std::map<FeedSession::Client, int> files_;
  std::set<FeedSession::Client> silent_;  // they have sent all they have to send
  FeedSession::Client next_ = 0;
};

}  // namespace tutti::program
