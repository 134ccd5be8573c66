// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/nats_child.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/pki/pki.hpp"

namespace tutti::test {

inline std::shared_ptr<const std::string> bytes(const std::string& text) {
  return std::make_shared<const std::string>(text);
}

/// A folder of `tutti pki` and, when it is started, a nats-server with the rights that are in it.
class PkiBus : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    auto made = pki::Pki::make(folder_ / "pki", "cave");
    ASSERT_TRUE(made.has_value()) << made.error().message;
    pki_.emplace(std::move(*made));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void start_bus() {
    auto started = bus::NatsChild::start(folder_ / "bus", {.rights = pki_->bus_configuration("").value(),
                                                           .credentials = credentials("server"),
                                                           .max_store_bytes = 256U << 20U,
                                                           .min_free_bytes = 0});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    child_ = std::move(*started);
  }
  /// As a server does once a second.
  void tend(const std::string& now = "") {
    child_->set_rights(pki_->bus_configuration(now).value());
    EXPECT_TRUE(child_->tend());
  }
  /// Whether it becomes true while the bus is tended.
  template <class Condition>
  bool tended_until(Condition&& condition, const std::string& now = "") {
    return test::within(30.0, [&] {
      tend(now);
      return condition();
    });
  }
  bus::BusCredentials add(bus::BusRole role, const std::string& name, std::optional<std::uint32_t> number = {},
                          int days = pki::kDays) {
    const auto file = pki_->add(role, name, number, days);
    EXPECT_TRUE(file.has_value()) << file.error().message;
    if (!child_) return credentials(name);
    tend();
    if (days > 0) wait_until_known(credentials(name));
    return credentials(name);
  }
  /// The bus reads its new rights when it gets to it: who comes before is refused once, and a test counts refusals.
  void wait_until_known(const bus::BusCredentials& who) {
    EXPECT_TRUE(tended_until([&] { return bus::NatsConnection::open(options(who), "newcomer").has_value(); }));
    static_cast<void>(child_->take_refusals());
  }
  /// A connection of its own. Its handshake may fall into the midst of the bus reading its rights again: then it is
  /// refused, and tried again as by whoever connects.
  std::shared_ptr<bus::NatsConnection> connect(const bus::BusCredentials& who) {
    std::shared_ptr<bus::NatsConnection> out;
    EXPECT_TRUE(test::within(10.0, [&] {
      if (auto opened = bus::NatsConnection::open(options(who), "test")) out = std::move(*opened);
      return out != nullptr;
    }));
    return out;
  }
  /// Whether the bus's log says, now or soon, that somebody was refused as one of these words.
  bool is_refused_as(const std::string& words) {
    return test::within(10.0, [&] {
      const auto refusals = child_->take_refusals().all;
      return std::ranges::any_of(refusals, [&](const auto& one) { return one.what.find(words) != std::string::npos; });
    });
  }
  /// The refusals since the last call of what is not members' to do. A handshake in whose midst the bus reads its
  /// rights again is refused, too, and tried again by whoever connects: that is none of these.
  std::vector<bus::BusRefusal> rights_refused() {
    std::vector<bus::BusRefusal> out = child_->take_refusals().all;
    std::erase_if(out, [](const bus::BusRefusal& refusal) {
      return refusal.key.empty() && refusal.what.find("uthentication") != std::string::npos;
    });
    return out;
  }
  [[nodiscard]] bus::BusCredentials credentials(const std::string& name) const {
    auto out = bus::read_credentials(pki_->credential(name).string()).value();
    out.file.clear();  // tests change them
    return out;
  }
  [[nodiscard]] bus::BusOptions options(const bus::BusCredentials& credentials) const {
    return {.url = child_->url(), .mission = "cave", .credentials = credentials, .max_stream_bytes = 16U << 20U};
  }
  [[nodiscard]] std::unique_ptr<bus::Port> open(bus::Endpoint endpoint, const bus::BusCredentials& credentials) const {
    auto port = bus::open_port(endpoint, options(credentials));
    EXPECT_TRUE(port.has_value()) << port.error().message;
    return port ? std::move(*port) : nullptr;
  }
  /// The messages that a port gets within a while.
  static std::vector<bus::Envelope> heard(bus::Port& port, std::size_t count) {
    std::vector<bus::Envelope> all;
    test::within(10.0, [&] {
      for (const bus::Received& received : port.receive()) {
        all.push_back(received.envelope);
        port.acknowledge(received.ticket);
      }
      return all.size() >= count;
    });
    return all;
  }

  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) / ("pki_" + std::to_string(getpid()));
  std::optional<pki::Pki> pki_;
  std::unique_ptr<bus::NatsChild> child_;
};

}  // namespace tutti::test
