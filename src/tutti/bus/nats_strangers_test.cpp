// SPDX-License-Identifier: BSD-3-Clause
// Jobs of strangers, and users who may not do all.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/nats_process.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/mission_lease.hpp"

namespace tutti::bus {
namespace nats_strangers_test {

using test::NatsNetwork;
using test::within;

const Endpoint kServer = Endpoint::server();
const Endpoint kRobot = Endpoint::of(RobotId{3});

class NatsStrangers : public ::testing::Test {
 protected:
  void SetUp() override { TUTTI_SKIP_WITHOUT_NATS_SERVER(); }
};

/// Jobs by strangers, and by earlier starts of this server.
TEST_F(NatsStrangers, JobsThatTheServerHasNotSentDoNotKeepItsOwnWaiting) {
  constexpr int kStrange = 2000;
  NatsNetwork network;
  const auto job = [](Port& hub, const std::string& id) {
    return hub.send(
        {kServer, Endpoint::any_worker(), MessageKind::job, id, std::make_shared<const std::string>("job")});
  };
  {
    const auto before = network.open(kServer);
    ASSERT_TRUE(job(*before, "before"));
    EXPECT_TRUE(within(30.0, [&] { return before->state().waiting_messages == 0; }));
  }
  const auto stranger = NatsConnection::open(network.options(kServer), "stranger").value();
  for (int i = 0; i < kStrange; ++i)
    ASSERT_TRUE(stranger->publish("mission.test.jobs.loop", "", "job/strange/" + std::to_string(i) + "/0.1", "junk"));
  stranger->flush();
  const auto hub = network.open(kServer);
  ASSERT_TRUE(job(*hub, "own"));
  EXPECT_TRUE(within(60.0, [&] { return hub->state().strange_jobs >= kStrange; })) << hub->state().strange_jobs;
  const auto worker = network.open(Endpoint::worker(1));
  std::vector<std::string> came;
  EXPECT_TRUE(within(30.0, [&] {
    for (const Received& received : worker->receive()) {
      came.push_back(received.envelope.id);
      worker->acknowledge(received.ticket);
    }
    return !came.empty();
  }));
  EXPECT_EQ(came, std::vector<std::string>{"own"});
  EXPECT_EQ(hub->state().strange_jobs, kStrange + 1U);
}

/// A user of the bus who may not send submaps, and one without a password.
TEST_F(NatsStrangers, WhatTheBusDoesNotAllowIsReportedAsThat) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / ("denied_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  test::NatsProcess bus(folder, R"(authorization { users: [
    { user: hub, password: all },
    { user: robot, password: some, permissions: { publish: { deny: "mission.*.robot.*.submap" } } } ] })");
  BusOptions options{.url = bus.url(), .mission = "test", .max_stream_bytes = 16U << 20U};
  options.credentials = {"hub", "all"};
  test::prepare(options);
  options.credentials = {"robot", "some"};
  const auto robot = open_port(kRobot, options).value();
  const auto submap = std::make_shared<const std::string>("submap");
  ASSERT_TRUE(robot->send({kRobot, kServer, MessageKind::submap, "7", submap}));
  EXPECT_TRUE(within(10.0, [&] { return !robot->state().denied.empty(); })) << robot->state().last_error;
  EXPECT_NE(robot->state().denied.find("mission.test.robot.3.submap"), std::string::npos) << robot->state().denied;
  options.credentials = {"robot", "wrong"};
  const auto lease = MissionLease::open(options, LeaseHolder{.host = "base", .state = "/s", .seat = "a"}).value();
  EXPECT_TRUE(within(10.0, [&] {
    const Status held = lease->check_held();
    return !held && held.error().message.find("Authentication Violation") != std::string::npos;
  })) << lease->check_held().error().message;
  const auto refused = open_port(kRobot, options).value();
  EXPECT_TRUE(within(10.0, [&] { return !refused->state().last_error.empty(); }));
  options.credentials = {};
  options.url.replace(0, 7, "nats://robot:wrong@");
  const auto in_url = open_port(kRobot, options).value();
  EXPECT_TRUE(within(10.0, [&] { return !in_url->state().last_error.empty(); }));
  EXPECT_EQ((in_url->state().url + in_url->state().last_error).find("wrong"), std::string::npos)
      << in_url->state().last_error;
  std::filesystem::remove_all(folder);
}

}  // namespace nats_strangers_test
}  // namespace tutti::bus
