// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include "tutti/program/feed/feed_session.hpp"

namespace tutti::program {

/// Who may connect, beside root.
struct FeedAccess {
  std::string group;     ///< Of the socket; empty: that of the program.
  unsigned mode = 0600;  ///< Of its file.
};

/// FeedSession on a Unix socket. Without a thread of its own: its program calls serve() again and again, which may be
/// what it waits in.
class FeedServer {
 public:
  /// Only who has `access` may connect. A socket that a killed program left there is replaced; an error when somebody
  /// listens on it, or it is another kind of file. `target` outlives the server.
  static Result<std::unique_ptr<FeedServer>> listen(const std::string& path, FeedTarget& target,
                                                    const FeedSettings& settings, const FeedAccess& access = {});
  ~FeedServer();
  FeedServer(const FeedServer&) = delete;
  FeedServer& operator=(const FeedServer&) = delete;

  /// Waits for something to do, at most so long (0: not at all), and does what can be done without waiting.
  void serve(int timeout_ms);
  [[nodiscard]] FeedSession& session() { return session_; }
  [[nodiscard]] std::size_t clients() const { return files_.size(); }

 private:
  FeedServer(std::string path, int listener, FeedTarget& target, const FeedSettings& settings);
  void accept_one();
  /// Of those that have not said who they are the one that came first; false: there is none.
  bool drop_silent();
  /// False: the connection has ended.
  bool read_from(FeedSession::Client client, int file);
  bool write_to(FeedSession::Client client, int file);
  void drop(FeedSession::Client client);

  std::string path_;
  int listener_ = -1;
  FeedSettings settings_;
  FeedSession session_;
  std::map<FeedSession::Client, int> files_;
  std::set<FeedSession::Client> silent_;  // they have said all they have to say
  FeedSession::Client next_ = 0;
};

}  // namespace tutti::program
