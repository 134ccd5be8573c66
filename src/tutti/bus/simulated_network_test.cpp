// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/simulated_network.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace tutti::bus {
namespace simulated_network_test {

TEST(SimulatedNetwork, WhatWaitsAtARobotGoesWithIt) {
  SimulatedNetwork network(SimulatedRadio(Timestamp{}, {.outages = {{0.0, 10.0}}}, 1), Timestamp{});
  const auto server = network.connect(Endpoint::server());
  const Endpoint alpha = Endpoint::of(RobotId{0});
  auto robot = network.connect(alpha);
  const auto send = [&](const char* id) {
    ASSERT_TRUE(robot->send(
        {alpha, Endpoint::server(), MessageKind::submap, id, std::make_shared<const std::string>("bytes")}));
  };
  send("lost");
  robot.reset();
  robot = network.connect(alpha);
  send("kept");
  network.advance(Timestamp{} + 20.0);
  const auto received = server->receive();
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].envelope.id, "kept");
}

TEST(SimulatedNetwork, OneEndpointHasOnePortAndSpeaksForItself) {
  SimulatedNetwork network(SimulatedRadio(Timestamp{}, {}, 1), Timestamp{});
  const auto server = network.connect(Endpoint::server());
  EXPECT_THROW(static_cast<void>(network.connect(Endpoint::server())), std::logic_error);
  const Envelope forged{Endpoint::of(RobotId{0}), Endpoint::server(), MessageKind::submap, "0/0/0",
                        std::make_shared<const std::string>()};
  EXPECT_THROW(static_cast<void>(server->send(forged)), std::logic_error);
}

}  // namespace simulated_network_test
}  // namespace tutti::bus
