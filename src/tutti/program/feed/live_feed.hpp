// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "tutti/program/feed/feed_front.hpp"
#include "tutti/program/feed/feed_server.hpp"

namespace tutti::program {

/// The live feed of a robot: a socket with a thread of its own, which answers clients from the front whatever the robot
/// behind it does, also while there is none because nothing can be stored.
class LiveFeed {
 public:
  /// FeedServer::listen(). `robot`: as it stands, all of it stored.
  static Result<std::unique_ptr<LiveFeed>> open(const std::string& socket, const FeedAccess& access, FeedState robot);
  ~LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;

  [[nodiscard]] FeedFront& front() { return front_; }
  [[nodiscard]] const FeedFront& front() const { return front_; }
  /// Somebody feeds.
  [[nodiscard]] bool is_fed() const { return is_fed_; }
  [[nodiscard]] FeedSession::Feeder feeder() const;
  /// What a client has made the thread throw, since the last call; empty: nothing. All clients lose their connection
  /// then, and may come again.
  std::string take_thrown();

 private:
  LiveFeed(std::string socket, FeedAccess access, FeedState robot)
      : socket_(std::move(socket)), access_(std::move(access)), front_(std::move(robot), {}) {}
  Status listen();
  void run(const std::stop_token& stop);
  void serve(int wait_ms);

  const std::string socket_;
  const FeedAccess access_;
  FeedFront front_;
  std::unique_ptr<FeedServer> server_;
  std::atomic<bool> is_fed_ = false;
  mutable std::mutex told_mutex_;  // of what follows
  std::string thrown_;
  FeedSession::Feeder feeder_;
  std::jthread thread_;
};

}  // namespace tutti::program
