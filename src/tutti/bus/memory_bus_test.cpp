// SPDX-License-Identifier: BSD-3-Clause
// The bus in memory beyond the contract of a port, and the choice of transports.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "tutti/bus/transport.hpp"

namespace tutti::bus {
namespace memory_bus_test {

const Endpoint kServer = Endpoint::server();
const Endpoint kRobot = Endpoint::of(RobotId{3});

Status send(Port& robot, MessageKind kind, const std::string& id, std::size_t bytes) {
  return robot.send({kRobot, kServer, kind, id, std::make_shared<const std::string>(bytes, 'x')});
}

TEST(MemoryBus, WhatIsNotAcknowledgedIsBoundedForEachSender) {
  const BusOptions options{.url = "memory://bounded", .max_waiting_bytes = 1000};
  const auto robot = open_port(kRobot, options).value(), hub = open_port(kServer, options).value();
  ASSERT_TRUE(send(*robot, MessageKind::submap, "a", 600));
  EXPECT_TRUE(send(*robot, MessageKind::submap, "a", 600));  // it waits already
  const Status refused = send(*robot, MessageKind::submap, "b", 600);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::io);
  EXPECT_NE(refused.error().message.find("600 bytes wait"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(send(*robot, MessageKind::status, "", 600));  // dropped
  EXPECT_TRUE(
      hub->send({kServer, kRobot, MessageKind::proxy_graph, "", std::make_shared<const std::string>(2000, 'x')}));
  const auto came = hub->receive();
  ASSERT_EQ(came.size(), 1U);
  EXPECT_FALSE(send(*robot, MessageKind::submap, "b", 600));
  hub->acknowledge(came[0].ticket);
  EXPECT_TRUE(send(*robot, MessageKind::submap, "b", 600));
  EXPECT_EQ(hub->receive().size(), 1U);
}

TEST(MemoryBus, NamesAndMissionsAreApart) {
  const auto hub = open_port(kServer, {.url = "memory://apart", .mission = "alps"}).value();
  const auto robot = open_port(kRobot, {.url = "memory://apart", .mission = "alps"}).value();
  for (const BusOptions& other : {BusOptions{.url = "memory://apart", .mission = "jura"},
                                  BusOptions{.url = "memory://elsewhere", .mission = "alps"}})
    ASSERT_TRUE(send(*open_port(kRobot, other).value(), MessageKind::submap, "other", 1));
  EXPECT_TRUE(hub->receive().empty());
  ASSERT_TRUE(send(*robot, MessageKind::submap, "own", 1));
  EXPECT_EQ(hub->receive().size(), 1U);
}

TEST(MemoryBus, APortConnectsWhenItMay) {
  BusOptions options{.url = "memory://may"};
  auto first = open_port(kRobot, options).value();
  EXPECT_TRUE(first->state().connected);
  const auto second = open_port(kRobot, options).value();  // of the same robot
  EXPECT_FALSE(second->state().connected);
  EXPECT_NE(second->state().last_error.find("robot 3"), std::string::npos) << second->state().last_error;
  EXPECT_FALSE(send(*second, MessageKind::submap, "a", 1));
  first.reset();
  EXPECT_TRUE(send(*second, MessageKind::submap, "a", 1));
  EXPECT_TRUE(second->state().connected);
  bool may = false;
  options.may_connect = [&may] { return may ? Status() : fail(ErrorCode::io, "not yet"); };
  const auto hub = open_port(kServer, options).value();
  EXPECT_TRUE(hub->receive().empty());
  EXPECT_EQ(hub->state().last_error, "not yet");
  may = true;
  EXPECT_EQ(hub->receive().size(), 1U);
}

TEST(MemoryBus, PortsAreOfDifferentThreads) {
  constexpr std::size_t kMessages = 500;
  const BusOptions options{.url = "memory://threads"};
  std::thread robot([&] {
    const auto port = open_port(kRobot, options).value();
    for (std::size_t i = 0; i < kMessages; ++i) EXPECT_TRUE(send(*port, MessageKind::submap, std::to_string(i), 10));
  });
  const auto hub = open_port(kServer, options).value();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  std::size_t came = 0;
  while (came < kMessages && std::chrono::steady_clock::now() < end)
    for (const Received& received : hub->receive()) {
      hub->acknowledge(received.ticket);
      ++came;
    }
  robot.join();
  EXPECT_EQ(came, kMessages);
}

TEST(Transports, AreChosenByTheUrl) {
  for (const Transport& row : transports()) {
    EXPECT_TRUE(row.example.starts_with(std::string(row.scheme) + "://")) << row.example;
    EXPECT_NE(transports_help().find(row.example), std::string::npos);
    const BusOptions where{.url = std::string(row.scheme) + "://localhost"};
    EXPECT_EQ(transport_of(where).value()->scheme, row.scheme);
  }
  EXPECT_EQ(transport_of({.url = "127.0.0.1:1"}).value()->scheme, "nats");
  const auto refused = open_port(kRobot, {.url = "mqtt://alpha:hidden@base"});
  ASSERT_FALSE(refused.has_value());
  for (const char* word : {"mqtt", "nats://HOST:PORT", "memory://NAME"})
    EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
  EXPECT_EQ(refused.error().message.find("hidden"), std::string::npos) << refused.error().message;
  EXPECT_FALSE(open_port(kRobot, {.url = "memory://"}).has_value());
}

}  // namespace memory_bus_test
}  // namespace tutti::bus
