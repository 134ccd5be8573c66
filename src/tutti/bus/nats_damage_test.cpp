// SPDX-License-Identifier: BSD-3-Clause
// A bus that has lost part of its disk, or keeps what nobody gets: the server's port notices and mends it.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "support/bus/nats_network.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::bus {
namespace nats_damage_test {

using test::NatsNetwork;
using test::within;

const Endpoint kServer = Endpoint::server();
const Endpoint kRobot = Endpoint::of(RobotId{3});

class NatsDamage : public ::testing::Test {
 protected:
  void SetUp() override { TUTTI_SKIP_WITHOUT_NATS_SERVER(); }

  static std::unique_ptr<Port> open_hub(const NatsNetwork& network, double stranded_s) {
    BusOptions options = network.options(kServer);
    options.stranded_s = stranded_s;
    return std::move(open_port(kServer, options).value());
  }
  static void send(Port& port, Endpoint to, MessageKind kind, int number) {
    const Endpoint from = kind == MessageKind::job ? kServer : kRobot;
    ASSERT_TRUE(port.send({from, to, kind, std::to_string(number), std::make_shared<const std::string>(20'000, 'x')}));
  }
};

/// As a power failure leaves it: acknowledged, and never written. The file system has made room for it.
void zero_the_last_block(const std::filesystem::path& stream) {
  std::filesystem::path last;
  for (const auto& entry : std::filesystem::directory_iterator(stream / "msgs"))
    if (entry.path().extension() == ".blk" && entry.path() > last) last = entry.path();
  ASSERT_FALSE(last.empty());
  const auto size = std::filesystem::file_size(last);
  ASSERT_GT(size, 0U);
  std::fstream(last, std::ios::in | std::ios::out | std::ios::binary)
      << std::string(static_cast<std::size_t>(size), '\0');
}

/// nats-server 2.9 begins the damaged stream anew with sequences that its consumer has behind it, and keeps what comes
/// from then on to itself, as long as the server's port is the same; and it takes no id of these again.
TEST_F(NatsDamage, AfterAPowerFailureNothingIsHeldBackForLong) {
  constexpr double kStranded_s = 2.0;
  NatsNetwork network;
  const auto robot = network.open(kRobot);
  const auto hub = open_hub(network, kStranded_s);
  std::map<int, int> came;
  const auto take = [&](int but_not) {
    for (const Received& received : hub->receive()) {
      const int number = std::stoi(received.envelope.id);
      ++came[number];
      if (number != but_not) hub->acknowledge(received.ticket);
    }
    return came.size();
  };
  for (int i = 0; i < 10; ++i) send(*robot, kServer, MessageKind::submap, i);
  ASSERT_TRUE(within(10.0, [&] { return take(9) == 10; }));
  within(1.5, [] { return false; });  // until the bus has written down what was acknowledged
  kill(network.child().pid(), SIGKILL);
  ASSERT_TRUE(within(5.0, [&] { return !network.child().running(); }));
  zero_the_last_block(network.folder() / "js/jetstream/$G/streams/SUBMAPS_test");
  const Status tended = network.child().tend();
  ASSERT_TRUE(tended.has_value()) << tended.error().message;
  const auto send_rest = [&] {
    for (int i = 10; i < 16; ++i) send(*robot, kServer, MessageKind::submap, i);
    return within(10.0, [&] { return robot->state().waiting_messages == 0; });
  };
  ASSERT_TRUE(send_rest());
  EXPECT_FALSE(within(0.5 * kStranded_s, [&] { return take(9) > 10; }));
  EXPECT_TRUE(within(10.0, [&] { return hub->state().streams_made_anew == 1; })) << hub->state().last_error;
  EXPECT_NE(hub->state().last_error.find("SUBMAPS_test"), std::string::npos) << hub->state().last_error;
  send(*robot, kServer, MessageKind::submap, 9);
  ASSERT_TRUE(send_rest());  // as for what has no receipt
  EXPECT_TRUE(within(10.0, [&] { return take(-1) == 16; })) << came.size();
  for (const auto& [number, times] : came) EXPECT_EQ(times, 1) << number;
  within(2.0 * kStranded_s, [&] { return take(-1), false; });
  EXPECT_EQ(hub->state().streams_made_anew, 1U) << hub->state().last_error;
}

/// Its disk is a new one: nobody starts again, and what was on it is sent again by those who keep it.
TEST_F(NatsDamage, ABusThatHasLostItsStoreIsSetUpAgain) {
  NatsNetwork network;
  const auto robot = network.open(kRobot);
  const auto hub = open_hub(network, 4.0);
  const auto bytes = std::make_shared<const std::string>("graph");
  ASSERT_TRUE(hub->send({kServer, kRobot, MessageKind::proxy_graph, "", bytes}));
  ASSERT_TRUE(within(10.0, [&] { return robot->state().connected && hub->state().waiting_messages == 0; }));
  send(*robot, kServer, MessageKind::submap, 0);
  std::set<std::string> came;
  const auto take = [&] {
    for (const Received& received : hub->receive()) {
      came.insert(received.envelope.id);
      if (received.envelope.id != "0") hub->acknowledge(received.ticket);  // that one only after the loss
    }
    return came.size();
  };
  ASSERT_TRUE(within(10.0, [&] { return take() == 1; }));
  kill(network.child().pid(), SIGKILL);
  ASSERT_TRUE(within(5.0, [&] { return !network.child().running(); }));
  std::filesystem::remove_all(network.folder() / "js");
  ASSERT_TRUE(network.child().tend().has_value());
  for (int i = 1; i < 5; ++i) send(*robot, kServer, MessageKind::submap, i);
  EXPECT_TRUE(within(20.0, [&] { return take() == 5; }))
      << came.size() << ", " << robot->state().waiting_messages << " wait; " << hub->state().last_error << "; "
      << robot->state().last_error;
  EXPECT_GE(hub->state().streams_made_anew, 1U);
  EXPECT_TRUE(within(10.0, [&] { return robot->state().waiting_messages == 0; }));
  const auto later = network.open(kRobot);  // another start: what is retained is there again
  EXPECT_TRUE(within(10.0, [&] {
    const auto heard = later->receive();
    return std::ranges::any_of(heard, [](const auto& one) { return *one.envelope.bytes == "graph"; });
  }));
  const auto worker = network.open(Endpoint::worker(1));
  send(*hub, Endpoint::any_worker(), MessageKind::job, 7);
  EXPECT_TRUE(within(10.0, [&] { return !worker->receive().empty(); }));
}

TEST_F(NatsDamage, JobsThatNobodyTakesAreKnownSinceWhen) {
  NatsNetwork network;
  const auto hub = open_hub(network, 0.8);
  send(*hub, Endpoint::any_worker(), MessageKind::job, 0);
  ASSERT_TRUE(within(10.0, [&] { return hub->state().jobs_untaken_s > 1.0; }));
  const auto worker = network.open(Endpoint::worker(1));
  EXPECT_TRUE(within(10.0, [&] { return !worker->receive().empty(); }));
  EXPECT_TRUE(within(5.0, [&] { return hub->state().jobs_untaken_s == 0.0; })) << "it is being worked on";
}

TEST_F(NatsDamage, AJobThatEndsEveryWorkerComesBackAndTheOthersStay) {
  NatsNetwork network;
  const auto hub = open_hub(network, 0.8);
  send(*hub, Endpoint::any_worker(), MessageKind::job, 0);
  ASSERT_TRUE(within(5.0, [&] { return hub->state().waiting_messages == 0; }));
  std::uint64_t ticket = 0;
  const auto got = [&](Port& worker, double seconds) {
    std::string id;
    within(seconds, [&] {
      for (const Received& received : worker.receive()) {
        id = received.envelope.id;
        ticket = received.ticket;
      }
      return !id.empty();
    });
    return id;
  };
  for (std::uint32_t i = 0; i < 5; ++i) {
    const auto ending = network.open(Endpoint::worker(i));
    EXPECT_EQ(got(*ending, 5.0), "0");
    if (i == 0) {
      within(0.5, [] { return false; });
      EXPECT_EQ(hub->state().given_in_vain, 0U);
    }
    if (i == 2) {
      EXPECT_TRUE(within(5.0, [&] { return hub->state().given_in_vain == 3; })) << hub->state().given_in_vain;
    }
  }
  const auto worker = network.open(Endpoint::worker(9));
  EXPECT_EQ(got(*worker, 0.5), "");
  send(*hub, Endpoint::any_worker(), MessageKind::job, 1);
  send(*hub, Endpoint::any_worker(), MessageKind::job, 2);
  EXPECT_EQ(got(*worker, 5.0), "1");
  within(2.0, [] { return false; });  // one that is being worked on is never removed
  EXPECT_EQ(hub->state().streams_made_anew, 0U) << hub->state().last_error;
  worker->acknowledge(ticket);
  EXPECT_EQ(got(*worker, 5.0), "2");
  EXPECT_TRUE(within(5.0, [&] { return hub->state().given_in_vain == 0; }));
  EXPECT_TRUE(within(5.0, [&] { return hub->state().jobs_removed == 1; })) << hub->state().last_error;
  const auto returned = hub->receive();
  ASSERT_EQ(returned.size(), 1U);
  EXPECT_EQ(returned[0].envelope.from, Endpoint::any_worker());
  EXPECT_EQ(returned[0].envelope.kind, MessageKind::job);
  EXPECT_EQ(returned[0].envelope.id, "0");
  EXPECT_FALSE(returned[0].envelope.bytes->empty());
  worker->acknowledge(ticket);
  send(*hub, Endpoint::any_worker(), MessageKind::job, 3);
  EXPECT_EQ(got(*worker, 5.0), "3");
  within(1.5, [] { return false; });
  EXPECT_EQ(hub->state().jobs_removed, 1U);
  EXPECT_EQ(hub->state().streams_made_anew, 0U) << hub->state().last_error;
}

/// A server that takes nothing for a while, and messages that come faster than it reads, are no damage.
TEST_F(NatsDamage, NothingIsMendedThatIsWhole) {
  NatsNetwork network;
  BusOptions options = network.options(kServer);
  options.stranded_s = 0.4;
  options.max_held_bytes = 100'000;
  const auto hub = std::move(open_port(kServer, options).value());
  const auto robot = network.open(kRobot);
  for (int i = 0; i < 50; ++i) send(*robot, kServer, MessageKind::submap, i);
  within(2.0, [] { return false; });
  std::set<int> came;
  int sent = 50;
  EXPECT_TRUE(within(60.0, [&] {
    if (sent < 1000) send(*robot, kServer, MessageKind::submap, sent++);
    for (const Received& received : hub->receive()) {
      came.insert(std::stoi(received.envelope.id));
      hub->acknowledge(received.ticket);
    }
    return came.size() == 1000;
  })) << came.size();
  EXPECT_EQ(hub->state().streams_made_anew, 0U) << hub->state().last_error;
}

}  // namespace nats_damage_test
}  // namespace tutti::bus
