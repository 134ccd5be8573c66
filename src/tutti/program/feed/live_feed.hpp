// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "tutti/program/feed/feed_front.hpp"
#include "tutti/program/feed/feed_server.hpp"

namespace tutti::program {

/// The live feed of a robot: a socket with a thread of its own. Clients are answered by a FeedFront whatever the robot
/// behind it does, even while there is no robot because nothing can be stored.
class LiveFeed {
 public:
  /// Listens as FeedServer::listen() does, with the same errors. `robot` is the robot's state now, all of which is
  /// stored; `sensors` is FeedSession's.
  static Result<std::unique_ptr<LiveFeed>> open(const std::string& socket, const FeedAccess& access, FeedState robot,
                                                intake::SensorConfig sensors = {});
  ~LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;

  /// Uses the server from another thread (LocalClient), while its own waits for clients. `last` is the number of the
  /// server that was used before, 0 before the first; it is set. False when that one is gone, or throws now.
  bool use(std::uint64_t& last, const std::function<void(FeedServer&)>& work);
  [[nodiscard]] FeedFront& front() { return front_; }
  [[nodiscard]] const FeedFront& front() const { return front_; }
  /// A client that feeds is connected.
  [[nodiscard]] bool is_fed() const { return is_fed_; }
  [[nodiscard]] FeedSession::Feeder feeder() const;
  /// The exception that the thread threw since the last call; empty: none. All clients lose their connection when it
  /// throws, and may connect again.
  std::string take_thrown();

 private:
  LiveFeed(std::string socket, FeedAccess access, FeedState robot, intake::SensorConfig sensors)
      : socket_(std::move(socket)),
        access_(std::move(access)),
        sensors_(std::move(sensors)),
        front_(std::move(robot), {}) {}
  Status listen();
  void run(const std::stop_token& stop);
  void serve(int wait_ms);
  void forget_server(const char* why);

  const std::string socket_;
  const FeedAccess access_;
  const intake::SensorConfig sensors_;
  FeedFront front_;
  std::mutex server_mutex_;  // guards server_ and its number
  std::unique_ptr<FeedServer> server_;
  std::uint64_t server_number_ = 0;
  std::atomic<bool> is_fed_ = false;
  mutable std::mutex report_mutex_;  // guards what follows
  std::string thrown_;
  FeedSession::Feeder feeder_;
  std::jthread thread_;
};

}  // namespace tutti::program
