// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_server.hpp"
#include "support/bus/tcp_relay.hpp"
#include "tutti/bus/nats_child.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::test {

/// Whether `condition` becomes true within `seconds`.
template <class Condition>
bool within(double seconds, Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  for (; std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(std::chrono::milliseconds(5)))
    if (condition()) return true;
  return condition();
}

/// Makes what the mission needs on the bus as programs do: by a server's port, which ends again.
inline void prepare(const bus::BusOptions& options) {
  const auto server = bus::open_port(bus::Endpoint::server(), options);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  EXPECT_TRUE(within(60.0, [&] { return (*server)->state().connected; })) << (*server)->state().last_error;
}

/// A nats-server in a folder of its own, with a link in front of it for the robots.
class NatsNetwork {
 public:
  explicit NatsNetwork(const TcpRelay::Link& link = {}) {
    static int number = 0;
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("nats_" + std::to_string(getpid()) + "_" + std::to_string(++number));
    auto started = bus::NatsChild::start(folder_, {.max_store_bytes = 256U << 20U, .min_free_bytes = 0});
    EXPECT_TRUE(started.has_value()) << started.error().message;
    child_ = std::move(*started);
    prepare(options(bus::Endpoint::server()));
    relay_ = std::make_unique<TcpRelay>(std::atoi(child_->url().substr(child_->url().rfind(':') + 1).c_str()), link);
  }
  ~NatsNetwork() {
    relay_.reset();
    child_.reset();
    std::filesystem::remove_all(folder_);
  }
  NatsNetwork(const NatsNetwork&) = delete;
  NatsNetwork& operator=(const NatsNetwork&) = delete;

  [[nodiscard]] bus::BusOptions options(bus::Endpoint endpoint) const {
    const std::string url = endpoint.robot() ? "nats://127.0.0.1:" + std::to_string(relay_->port()) : child_->url();
    return {.url = url, .mission = "test", .max_stream_bytes = 128U << 20U};
  }
  [[nodiscard]] std::unique_ptr<bus::Port> open(bus::Endpoint endpoint) const {
    auto port = bus::open_port(endpoint, options(endpoint));
    EXPECT_TRUE(port.has_value()) << port.error().message;
    return std::move(*port);
  }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] bus::NatsChild& child() { return *child_; }
  [[nodiscard]] TcpRelay& relay() { return *relay_; }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<bus::NatsChild> child_;
  std::unique_ptr<TcpRelay> relay_;
};

}  // namespace tutti::test
