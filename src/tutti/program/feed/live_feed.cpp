// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/live_feed.hpp"

#include <chrono>
#include <exception>
#include <utility>

namespace tutti::program {
namespace {

constexpr int kWait_ms = 20;  // then it says what the robot has to say
constexpr std::chrono::milliseconds kListensAgain{500};

}  // namespace

Result<std::unique_ptr<LiveFeed>> LiveFeed::open(const std::string& socket, const FeedAccess& access, FeedState robot,
                                                 intake::SensorConfig sensors) {
  std::unique_ptr<LiveFeed> feed(new LiveFeed(socket, access, std::move(robot), std::move(sensors)));
  if (Status ok = feed->listen(); !ok) return tl::unexpected(ok.error());
  feed->thread_ = std::jthread([raw = feed.get()](const std::stop_token& stop) { raw->run(stop); });
  return feed;
}

LiveFeed::~LiveFeed() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

Status LiveFeed::listen() {
  auto server = FeedServer::listen(socket_, front_, {}, access_, sensors_);
  if (!server) return tl::unexpected(server.error());
  server_ = std::move(*server);
  return {};
}

void LiveFeed::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) serve(kWait_ms);
  for (int i = 0; i < 2; ++i) serve(0);  // what is still to be said
}

void LiveFeed::serve(int wait_ms) {
  try {
    if (!server_ && !listen()) return std::this_thread::sleep_for(kListensAgain);
    server_->serve(wait_ms);
    is_fed_ = server_->session().has_feeder();
    const std::scoped_lock lock(told_mutex_);
    feeder_ = server_->session().feeder();
  } catch (const std::exception& error) {
    is_fed_ = false;
    server_.reset();  // whose bytes they were is not known
    const std::scoped_lock lock(told_mutex_);
    thrown_ = error.what();
  }
}

FeedSession::Feeder LiveFeed::feeder() const {
  const std::scoped_lock lock(told_mutex_);
  return feeder_;
}

std::string LiveFeed::take_thrown() {
  const std::scoped_lock lock(told_mutex_);
  return std::exchange(thrown_, {});
}

}  // namespace tutti::program
