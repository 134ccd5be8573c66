// SPDX-License-Identifier: BSD-3-Clause
// Tests that port_conformance_test.cpp does not have: kills, limits, garbage, and links that break.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nats/nats.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <set>
#include <string>

#include "support/bus/nats_network.hpp"
#include "tutti/base/content_hash.hpp"
#include "tutti/base/random.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::bus {
namespace nats_port_test {

using test::NatsNetwork;
using test::within;

const Endpoint kServer = Endpoint::server();
const Endpoint kRobot = Endpoint::of(RobotId{3});

std::string bytes_of(int number, std::uint64_t most) {
  Rng rng(static_cast<std::uint64_t>(number));
  std::string bytes(rng.index(most), '\0');
  for (char& c : bytes) c = static_cast<char>(rng.index(256));
  return bytes;
}

Status send_submap(Port& robot, const std::string& id, std::string bytes) {
  return robot.send({kRobot, kServer, MessageKind::submap, id, std::make_shared<const std::string>(std::move(bytes))});
}

/// Takes each message and acknowledges it, as a server does. Counts how often each id came.
class Receiver {
 public:
  explicit Receiver(std::uint64_t most) : most_(most) {}
  void take(Port& hub) {
    for (const Received& received : hub.receive()) {
      const int number = std::stoi(received.envelope.id);
      EXPECT_EQ(*received.envelope.bytes, bytes_of(number, most_)) << number;
      ++came_[number];
      hub.acknowledge(received.ticket);
    }
  }
  [[nodiscard]] std::size_t heard() const { return came_.size(); }
  [[nodiscard]] int again() const {
    int again = 0;
    for (const auto& [number, times] : came_) again += times - 1;
    return again;
  }

 private:
  std::uint64_t most_;
  std::map<int, int> came_;
};

class NatsPortTest : public ::testing::Test {
 protected:
  void SetUp() override { TUTTI_SKIP_WITHOUT_NATS_SERVER(); }
};

TEST_F(NatsPortTest, KilledAndStartedAgainTheBusLosesNothing) {
  constexpr int kMessages = 300;
  constexpr std::uint64_t kMost = 200'000;
  NatsNetwork network;
  const auto robot = network.open(kRobot);
  const auto hub = network.open(kServer);
  Receiver receiver(kMost);
  int kills = 0;
  int sent = 0;
  const bool all = within(150.0, [&] {
    for (const int most = static_cast<int>(receiver.heard()) + 40; sent < std::min(kMessages, most); ++sent)
      EXPECT_TRUE(send_submap(*robot, std::to_string(sent), bytes_of(sent, kMost)));
    if (kills < 3 && receiver.heard() > static_cast<std::size_t>(20 + 80 * kills)) {
      ++kills;
      kill(network.child().pid(), SIGKILL);
      EXPECT_TRUE(within(5.0, [&] { return !network.child().running(); }));
      const Status tended = network.child().tend();
      EXPECT_TRUE(tended.has_value()) << tended.error().message;
    }
    receiver.take(*hub);
    return receiver.heard() == kMessages;
  });
  EXPECT_TRUE(all) << receiver.heard() << " of " << kMessages << " came; " << robot->state().last_error;
  EXPECT_EQ(kills, 3);
  EXPECT_EQ(receiver.again(), 0);
  EXPECT_TRUE(within(5.0, [&] { return robot->state().waiting_messages == 0; }));
  EXPECT_GE(robot->state().reconnects, 3U);
}

/// A robot's last status reports that it has finished: without it operators would search for it.
TEST_F(NatsPortTest, WhatIsSentLastIsHeardThoughThePortGoesAtOnce) {
  NatsNetwork network;
  const auto hub = network.open(kServer);
  ASSERT_TRUE(within(20.0, [&] { return hub->state().connected; }));
  for (int i = 0; i < 20; ++i) {
    const std::string last = std::to_string(i);
    {
      const auto robot = network.open(kRobot);
      ASSERT_TRUE(within(20.0, [&] { return robot->state().connected; }));
      ASSERT_TRUE(robot->send({kRobot, kServer, MessageKind::status, {}, std::make_shared<const std::string>(last)}));
    }
    ASSERT_TRUE(within(10.0, [&] {
      const auto came = hub->receive();
      return !came.empty() && *came.back().envelope.bytes == last;
    })) << i;
  }
}

TEST_F(NatsPortTest, OverALinkThatBreaksAgainAndAgainNothingIsLost) {
  constexpr int kMessages = 30;
  constexpr std::uint64_t kMost = 80'000;
  NatsNetwork network({.delay_s = 0.05, .bytes_per_s = 1e6, .bytes_between_cuts = 300'000});
  const auto hub = network.open(kServer);
  const auto robot = network.open(kRobot);
  const auto graph = std::make_shared<const std::string>(5000, 'g');
  for (int i = 0; i < kMessages; ++i) ASSERT_TRUE(send_submap(*robot, std::to_string(i), bytes_of(i, kMost)));
  ASSERT_TRUE(hub->send({kServer, kRobot, MessageKind::proxy_graph, "", graph}));
  Receiver receiver(kMost);
  std::string heard;
  const auto go_on = [&] {
    receiver.take(*hub);
    for (const Received& received : robot->receive()) heard = *received.envelope.bytes;
  };
  EXPECT_TRUE(within(20.0, [&] { return go_on(), receiver.heard() > 3; }));
  network.relay().hold(true);  // out of range, and nobody learns of it
  within(1.0, [&] { return go_on(), false; });
  network.relay().hold(false);
  EXPECT_TRUE(within(20.0, [&] { return go_on(), receiver.heard() > 10; }));
  network.relay().refuse(true);
  const std::size_t before = receiver.heard();
  within(1.5, [&] { return go_on(), false; });
  EXPECT_LT(receiver.heard(), static_cast<std::size_t>(kMessages));
  EXPECT_LE(receiver.heard(), before + 8);  // what was on the bus already
  network.relay().refuse(false);
  EXPECT_TRUE(within(60.0, [&] { return go_on(), receiver.heard() == kMessages && heard == *graph; }))
      << receiver.heard() << " of " << kMessages << " came; " << robot->state().last_error;
  EXPECT_EQ(receiver.again(), 0);
  EXPECT_GE(network.relay().cuts(), 3U);
}

/// Debian's libnats 3.4.1 writes past its list when messages of an earlier fetch come late (nats.c #749): the process
/// ends with "double free" or "invalid next size".
TEST_F(NatsPortTest, AServerWhoseLinkStallsTakesEverything) {
  constexpr std::size_t kMessages = 700;
  NatsNetwork network({.delay_s = 0.12});
  BusOptions far = network.options(kRobot), near = network.options(kServer);  // the server is behind the relay
  const auto hub = std::move(open_port(kServer, far).value());
  const auto robot = std::move(open_port(kRobot, near).value());
  ASSERT_TRUE(within(10.0, [&] { return hub->state().connected; }));
  for (std::size_t i = 0; i < kMessages; ++i)
    ASSERT_TRUE(send_submap(*robot, std::to_string(i), std::string(1000, 'x')));
  std::set<std::string> came;
  EXPECT_TRUE(within(30.0,
                     [&] {
                       for (const Received& received : hub->receive()) came.insert(received.envelope.id);
                       return came.size() == kMessages;
                     }))
      << came.size() << " of " << kMessages << " came; " << hub->state().last_error;
}

TEST_F(NatsPortTest, ABusThatIsFullTakesTheRestWhenThereIsRoom) {
  NatsNetwork network;
  BusOptions options = network.options(kServer);
  options.max_stream_bytes = 1U << 20U;
  test::prepare(options);
  const auto robot = network.open(kRobot);
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(send_submap(*robot, std::to_string(i), bytes_of(i, 200'000)));
  EXPECT_TRUE(within(10.0, [&] { return robot->state().last_error.find("maximum bytes") != std::string::npos; }))
      << robot->state().last_error;
  EXPECT_GT(robot->state().waiting_messages, 0U);
  const auto hub = open_port(kServer, options);
  ASSERT_TRUE(hub.has_value());
  Receiver receiver(200'000);
  EXPECT_TRUE(within(20.0, [&] { return receiver.take(**hub), receiver.heard() == 30; }));
  EXPECT_EQ(receiver.again(), 0);
}

TEST_F(NatsPortTest, AMissionForWhichTheBusHasNoRoomLearnsWhatToDo) {
  NatsNetwork network;  // 256 MB, of which mission "test" has set 240 aside
  BusOptions options = network.options(kServer);
  options.mission = "other";
  {
    const auto refused = open_port(kServer, options);
    ASSERT_TRUE(refused.has_value());
    EXPECT_TRUE(within(10.0, [&] { return !(*refused)->state().last_error.empty(); }));
    for (const char* expected : {"SUBMAPS_other", "128 MB", "max_file", "nats stream rm"})
      EXPECT_NE((*refused)->state().last_error.find(expected), std::string::npos)
          << expected << " in " << (*refused)->state().last_error;
    EXPECT_FALSE((*refused)->state().connected);
  }
  options.max_stream_bytes = 4U << 20U;
  test::prepare(options);
  EXPECT_GE(NatsChildOptions{}.max_store_bytes, 4 * 15 * BusOptions{}.max_stream_bytes / 8);  // four missions
}

TEST_F(NatsPortTest, HoldsNoMoreThanItMayAndTheRestStaysOnTheBus) {
  NatsNetwork network;
  const auto robot = network.open(kRobot);
  BusOptions options = network.options(kServer);
  options.max_held_bytes = 500'000;
  auto hub = open_port(kServer, options);
  ASSERT_TRUE(hub.has_value());
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(send_submap(*robot, std::to_string(i), std::string(50'000, 'x')));
  EXPECT_TRUE(within(10.0, [&] { return robot->state().waiting_messages == 0; }));
  std::vector<Received> taken;
  within(0.5, [&] {
    for (Received& received : (*hub)->receive()) taken.push_back(std::move(received));
    return false;
  });
  EXPECT_GE(taken.size(), 10U);
  EXPECT_LE(taken.size(), 10U + 32U);
  std::size_t heard = 0;
  EXPECT_TRUE(within(10.0, [&] {
    for (const Received& received : taken) (*hub)->acknowledge(received.ticket);
    heard += taken.size();
    taken = (*hub)->receive();
    return heard == 100;
  }));
}

/// Not a test: a server that takes everything, acknowledges nothing, and is killed.
TEST(NatsPortOwner, DISABLED_AcknowledgesNothing) {
  const auto hub =
      open_port(kServer, {.url = std::getenv("TUTTI_NATS_URL"), .mission = "test", .max_stream_bytes = 128U << 20U});
  ASSERT_TRUE(hub.has_value());
  const int pipe_end = std::atoi(std::getenv("TUTTI_NATS_PIPE"));
  while (true)
    for (const Received& received : (*hub)->receive())
      if (write(pipe_end, received.envelope.id.data(), 1) != 1) return;
}

TEST_F(NatsPortTest, WhatAKilledServerHadNotAcknowledgedComesAtOnceToTheNext) {
  NatsNetwork network;
  const auto robot = network.open(kRobot);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(send_submap(*robot, std::to_string(i), bytes_of(i, 300'000)));
  int ends[2] = {-1, -1};
  ASSERT_EQ(pipe(ends), 0);
  setenv("TUTTI_NATS_URL", network.child().url().c_str(), 1);
  setenv("TUTTI_NATS_PIPE", std::to_string(ends[1]).c_str(), 1);
  const pid_t owner = fork();
  if (owner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    execl("/proc/self/exe", "owner", "--gtest_filter=NatsPortOwner.*", "--gtest_also_run_disabled_tests", nullptr);
    _exit(1);
  }
  for (int i = 0; i < 5; ++i) {
    char id = ' ';
    ASSERT_EQ(read(ends[0], &id, 1), 1);
  }
  kill(owner, SIGKILL);
  waitpid(owner, nullptr, 0);
  close(ends[0]);
  close(ends[1]);
  const auto hub = network.open(kServer);
  Receiver receiver(300'000);
  EXPECT_TRUE(within(5.0, [&] { return receiver.take(*hub), receiver.heard() == 5; }));  // not after the bus's 30 s
}

TEST_F(NatsPortTest, GarbageIsCountedAndBlocksNobody) {
  NatsNetwork network;
  const auto hub = network.open(kServer);
  const auto robot = network.open(kRobot);
  natsConnection* connection = nullptr;
  jsCtx* streams = nullptr;
  ASSERT_EQ(natsConnection_ConnectTo(&connection, network.child().url().c_str()), NATS_OK);
  ASSERT_EQ(natsConnection_JetStream(&streams, connection, nullptr), NATS_OK);
  int refused = 0;
  constexpr const char* kHalf = "submap/b/h00000000000000aa/0.2";  // of a message: it waits for the other half
  for (const char* id : {"", "submap", "submap/a/7.3", "verdicts/a/0.1", kHalf, "submap/b/1.3"}) {
    jsPubOptions options;
    jsPubOptions_Init(&options);
    if (*id != '\0') options.MsgId = id;
    EXPECT_EQ(js_Publish(nullptr, streams, "mission.test.robot.5.submap", "junk", 4, &options, nullptr), NATS_OK) << id;
    if (id != kHalf) ++refused;
  }
  EXPECT_EQ(natsConnection_PublishString(connection, "mission.test.apple.5.status", "junk"), NATS_OK);
  jsCtx_Destroy(streams);
  natsConnection_Destroy(connection);
  ASSERT_TRUE(send_submap(*robot, "7", bytes_of(7, 1000)));
  Receiver receiver(1000);
  EXPECT_TRUE(within(5.0, [&] { return receiver.take(*hub), receiver.heard() == 1; }));
  EXPECT_TRUE(within(5.0, [&] { return hub->state().refused == static_cast<std::uint64_t>(refused); }))
      << hub->state().refused;
  EXPECT_NE(hub->state().last_error.find("none of ours"), std::string::npos) << hub->state().last_error;
}

/// A few hundred bytes of somebody's.
class Stranger {
 public:
  explicit Stranger(const std::string& url) {
    EXPECT_EQ(natsConnection_ConnectTo(&connection_, url.c_str()), NATS_OK);
    EXPECT_EQ(natsConnection_JetStream(&streams_, connection_, nullptr), NATS_OK);
  }
  ~Stranger() {
    jsCtx_Destroy(streams_);
    natsConnection_Destroy(connection_);
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  void store(const std::string& subject, const std::string& id, const std::string& bytes) const {
    jsPubOptions options;
    jsPubOptions_Init(&options);
    options.MsgId = id.c_str();
    EXPECT_EQ(
        js_Publish(nullptr, streams_, subject.c_str(), bytes.data(), static_cast<int>(bytes.size()), &options, nullptr),
        NATS_OK)
        << id;
  }

 private:
  natsConnection* connection_ = nullptr;
  jsCtx* streams_ = nullptr;
};

/// The part of a message's id that its bytes give.
std::string with_content(const std::string& bytes) { return fmt::format("/h{:016x}", content_hash(bytes)); }

TEST_F(NatsPortTest, OrphanPartsStopNobody) {
  NatsNetwork network;
  const auto hub = network.open(kServer);
  const auto robot = network.open(kRobot);
  const Stranger stranger(network.child().url());
  for (int i = 0; i < 1100; ++i) {
    const std::string from = i % 2 == 0 ? "3" : "5";  // the robot's own number, too
    stranger.store("mission.test.robot." + from + ".submap",
                   "submap/orphan " + std::to_string(i) + with_content("o") + "/0.2", "o");
  }
  ASSERT_TRUE(send_submap(*robot, "7", bytes_of(7, 300'000)));
  Receiver receiver(300'000);
  EXPECT_TRUE(within(10.0, [&] { return receiver.take(*hub), receiver.heard() == 1; })) << hub->state().last_error;
}

TEST_F(NatsPortTest, WhoUsesARobotsIdsBeforeItDoesDoesNotBlockIt) {
  NatsNetwork network;
  const auto hub = network.open(kServer);
  const auto robot = network.open(kRobot);
  const Stranger stranger(network.child().url());
  for (int i = 0; i < 3; ++i)
    stranger.store("mission.test.robot.3.submap", "submap/" + std::to_string(i) + with_content("junk") + "/0.1",
                   "junk");
  std::map<std::string, std::set<std::string>> came;
  const auto take = [&] {
    for (const Received& received : hub->receive()) {
      came[received.envelope.id].insert(*received.envelope.bytes);
      hub->acknowledge(received.ticket);
    }
  };
  EXPECT_TRUE(within(10.0, [&] { return take(), came.size() == 3; }));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(send_submap(*robot, std::to_string(i), "real"));
  EXPECT_TRUE(within(10.0, [&] {
    take();
    return std::ranges::all_of(came, [](const auto& of_id) { return of_id.second.contains("real"); });
  }));
}

TEST(BusOptionsTest, OtherMachinesNeedTlsAndMissionsAName) {
  const auto refusal = [](const BusOptions& options) {
    const auto port = open_port(kRobot, options);
    return port ? "" : port.error().message;
  };
  EXPECT_NE(refusal({.url = "nats://10.0.0.1:4222"}).find("10.0.0.1"), std::string::npos);
  EXPECT_NE(refusal({.url = "nats://user:word@10.0.0.1:4222"}).find("TLS"), std::string::npos);
  EXPECT_EQ(refusal({.url = "nats://user:word@10.0.0.1:4222"}).find("word"), std::string::npos);
  EXPECT_NE(refusal({.url = "nats://127.0.0.1.example.invalid:4222"}).find("TLS"), std::string::npos);
  EXPECT_NE(refusal({.url = "nats://127.0.0.1:4222", .mission = "a.b"}).find("'a.b'"), std::string::npos);
  EXPECT_EQ(refusal({.url = "nats://127.0.0.1:1"}), "");  // waits for one
  EXPECT_EQ(refusal({.url = "nats://10.0.0.1:4222", .allow_insecure = true}), "");
}

}  // namespace nats_port_test
}  // namespace tutti::bus
