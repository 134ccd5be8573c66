// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/live_feed.hpp"

#include <chrono>
#include <exception>
#include <utility>

namespace tutti::program {
namespace {

constexpr int kWait_ms = 20;  // then it sends what the robot has to send
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
  ++server_number_;
  return {};
}

void LiveFeed::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) serve(kWait_ms);
  for (int i = 0; i < 2; ++i) serve(0);  // what is still to be sent
}

void LiveFeed::serve(int wait_ms) {
  std::unique_lock lock(server_mutex_);
  try {
    if (!server_ && !listen()) {
      lock.unlock();
      return std::this_thread::sleep_for(kListensAgain);
    }
    FeedServer::Waiting waiting = server_->begin();
    const std::uint64_t number = server_number_;
    lock.unlock();
    const bool is_ready = FeedServer::wait(waiting, wait_ms);
    lock.lock();
    if (!server_ || number != server_number_) return;  // it has thrown meanwhile
    if (is_ready) server_->finish(waiting);
    is_fed_ = server_->session().has_feeder();
    const std::scoped_lock report_lock(report_mutex_);
    feeder_ = server_->session().feeder();
  } catch (const std::exception& error) {
    forget_server(error.what());
  }
}

bool LiveFeed::use(std::uint64_t& last, const std::function<void(FeedServer&)>& work) {
  const std::scoped_lock lock(server_mutex_);
  if (!server_ || (last != 0 && last != server_number_)) return false;
  last = server_number_;
  try {
    work(*server_);
    return true;
  } catch (const std::exception& error) {
    forget_server(error.what());
    return false;
  }
}

/// Whose bytes they were is not known.
void LiveFeed::forget_server(const char* why) {
  is_fed_ = false;
  server_.reset();
  const std::scoped_lock lock(report_mutex_);
  thrown_ = why;
}

FeedSession::Feeder LiveFeed::feeder() const {
  const std::scoped_lock lock(report_mutex_);
  return feeder_;
}

std::string LiveFeed::take_thrown() {
  const std::scoped_lock lock(report_mutex_);
  return std::exchange(thrown_, {});
}

}  // namespace tutti::program
