// SPDX-License-Identifier: BSD-3-Clause
// The contract of Port (port.hpp, delivery.hpp), tested for each implementation.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/port_networks.hpp"
#include "tutti/bus/port.hpp"

namespace tutti::bus {
namespace port_conformance_test {

class PortConformance : public ::testing::TestWithParam<test::PortImplementation> {
 protected:
  using Messages = std::multiset<std::string>;

  void SetUp() override {
    if (GetParam().needs_nats) TUTTI_SKIP_WITHOUT_NATS_SERVER();
    network = GetParam().make();
  }

  void send(Port& port, Endpoint from, Endpoint to, MessageKind kind, const std::string& id, const std::string& bytes) {
    const Status sent = port.send({from, to, kind, id, std::make_shared<const std::string>(bytes)});
    ASSERT_TRUE(sent.has_value()) << sent.error().message;
  }
  void send_submap(Port& robot, const std::string& id) {
    send(robot, alpha, server, MessageKind::submap, id, "submap " + id);
  }
  void send_job(Port& port, const std::string& id) {
    const MessageKind kind = id == "b" ? MessageKind::refinement_job : MessageKind::job;  // of one queue
    send(port, server, Endpoint::any_worker(), kind, id, "job " + id);
  }
  /// Receives until nothing more comes. Expected messages may need many rounds on a busy machine; if none are, a few
  /// must pass.
  std::vector<Received> receive(Port& port, const std::function<bool(const std::vector<Received>&)>& is_enough,
                                int patience = 50) {
    std::vector<Received> all;
    for (int quiet = 0; quiet < (is_enough(all) ? 1 : patience);) {
      network->settle();
      std::vector<Received> some = port.receive();
      quiet = some.empty() ? quiet + 1 : 0;
      std::ranges::move(some, std::back_inserter(all));
    }
    return all;
  }
  std::vector<Received> receive(Port& port, std::size_t expected) {
    return receive(port, [&](const auto& all) { return all.size() >= expected; });
  }
  /// The messages that come within a few rounds, if any do.
  std::vector<Received> receive(Port& port) {
    return receive(
        port, [](const auto& all) { return !all.empty(); }, 5);
  }
  /// The messages that have come by now, acknowledged if their id is not in `keep_back`.
  Messages take(Port& port, std::size_t expected = 0, const std::set<std::string>& keep_back = {}) {
    Messages ids;
    for (const Received& received : expected == 0 ? receive(port) : receive(port, expected)) {
      ids.insert(received.envelope.id);
      if (!keep_back.contains(received.envelope.id)) port.acknowledge(received.ticket);
    }
    return ids;
  }
  /// The newest message of this kind has these bytes.
  void expect_newest(Port& port, MessageKind kind, const std::string& expected) {
    const auto newest = [&](const std::vector<Received>& all) {
      std::string bytes;
      for (const Received& received : all)
        if (received.envelope.kind == kind) bytes = *received.envelope.bytes;
      return bytes;
    };
    EXPECT_EQ(newest(receive(port, [&](const auto& all) { return newest(all) == expected; })), expected);
  }

  std::unique_ptr<test::PortNetwork> network;
  Endpoint server = Endpoint::server(), alpha = Endpoint::of(RobotId{0}), bravo = Endpoint::of(RobotId{1});
  Endpoint first = Endpoint::worker(0), second = Endpoint::worker(1);
};

TEST_P(PortConformance, AMessageArrivesAsItWasSent) {
  const auto robot = network->connect(alpha), other = network->connect(bravo), hub = network->connect(server);
  std::string bytes(1U << 20U, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7);
  send(*robot, alpha, server, MessageKind::submap, "0/1700000000/0", bytes);
  send(*other, bravo, server, MessageKind::submap, "1/1700000000/0", "");
  const auto received = receive(*hub, 2);
  ASSERT_EQ(received.size(), 2U);
  const bool in_order = received[0].envelope.from == alpha;
  const Envelope& large = received[in_order ? 0 : 1].envelope;
  const Envelope& empty = received[in_order ? 1 : 0].envelope;
  EXPECT_EQ(large.to, server);
  EXPECT_EQ(large.kind, MessageKind::submap);
  EXPECT_EQ(large.id, "0/1700000000/0");
  EXPECT_TRUE(*large.bytes == bytes);
  EXPECT_EQ(empty.from, bravo);
  EXPECT_EQ(empty.id, "1/1700000000/0");
  EXPECT_EQ(*empty.bytes, "");
  EXPECT_NE(received[0].ticket, received[1].ticket);
  EXPECT_TRUE(receive(*robot).empty());
}

TEST_P(PortConformance, AnOperatorsDecisionWaitsForTheServer) {
  const Endpoint viewer = Endpoint::viewer(7);
  const auto port = network->connect(viewer);
  send(*port, viewer, server, MessageKind::decision, "accept/5/1", "word");
  network->settle();
  for (int start = 0; start < 2; ++start) {
    const auto hub = network->connect(server);
    const auto received = receive(*hub, 1);
    ASSERT_EQ(received.size(), 1U) << "start " << start;
    EXPECT_EQ(received[0].envelope.from.role, Endpoint::Role::viewer);
    EXPECT_EQ(received[0].envelope.kind, MessageKind::decision);
    EXPECT_EQ(*received[0].envelope.bytes, "word");
    if (start == 1) hub->acknowledge(received[0].ticket);
  }
}

TEST_P(PortConformance, DurableMessagesComeUntilTheyAreAcknowledged) {
  const auto robot = network->connect(alpha), worker = network->connect(first);
  auto hub = network->connect(server);
  for (const char* id : {"a", "b"}) send_submap(*robot, id);
  send(*worker, first, server, MessageKind::verdicts, "c", "verdicts");
  EXPECT_EQ(take(*hub, 3, {"b", "c"}), (Messages{"a", "b", "c"}));
  hub.reset();
  send_submap(*robot, "d");
  network->settle();
  hub = network->connect(server);
  EXPECT_EQ(take(*hub, 3, {"c"}), (Messages{"b", "c", "d"}));
  hub.reset();
  hub = network->connect(server);
  EXPECT_EQ(take(*hub, 1), (Messages{"c"}));
  hub.reset();
  hub = network->connect(server);
  EXPECT_EQ(take(*hub), Messages{});
}

TEST_P(PortConformance, DurableMessagesWaitForAReceiverThatHasYetToStart) {
  auto robot = network->connect(alpha);
  send_submap(*robot, "a");
  network->settle();
  robot.reset();  // it has left: whoever sent it may go
  const auto hub = network->connect(server);
  EXPECT_EQ(take(*hub, 1), (Messages{"a"}));
}

TEST_P(PortConformance, SentAgainItComesAtLeastOnceAndEndsWithItsAcknowledgements) {
  auto robot = network->connect(alpha);
  auto hub = network->connect(server);
  for (int i = 0; i < 3; ++i) send_submap(*robot, "a");
  const Messages heard = take(*hub, 1);
  EXPECT_GE(heard.size(), 1U);
  EXPECT_EQ(heard.count("a"), heard.size());
  hub.reset();
  hub = network->connect(server);
  EXPECT_EQ(take(*hub), Messages{});
}

TEST_P(PortConformance, OfRetainedMessagesTheNewestCountsAndALateReceiverGetsIt) {
  const auto hub = network->connect(server);
  auto robot = network->connect(alpha);
  for (const char* graph : {"1", "2", "3"}) send(*hub, server, alpha, MessageKind::proxy_graph, "", graph);
  send(*hub, server, alpha, MessageKind::receipt, "", "receipt");
  expect_newest(*robot, MessageKind::proxy_graph, "3");
  EXPECT_TRUE(receive(*robot).empty());
  robot.reset();
  robot = network->connect(alpha);
  std::map<MessageKind, std::string> values;
  for (const Received& received : receive(*robot, 2)) {
    values[received.envelope.kind] = *received.envelope.bytes;
    robot->acknowledge(received.ticket);
  }
  EXPECT_EQ(values,
            (std::map<MessageKind, std::string>{{MessageKind::proxy_graph, "3"}, {MessageKind::receipt, "receipt"}}));
  send(*hub, server, alpha, MessageKind::proxy_graph, "", "4");
  expect_newest(*robot, MessageKind::proxy_graph, "4");
  robot.reset();
  send(*hub, server, alpha, MessageKind::proxy_graph, "", "5");
  network->settle();
  robot = network->connect(alpha);
  expect_newest(*robot, MessageKind::proxy_graph, "5");
}

TEST_P(PortConformance, ARetainedMessageIsItsReceiversOwn) {
  const auto hub = network->connect(server);
  send(*hub, server, alpha, MessageKind::proxy_graph, "", "for alpha");
  send(*hub, server, bravo, MessageKind::proxy_graph, "", "for bravo");
  const auto a = network->connect(alpha), b = network->connect(bravo), c = network->connect(Endpoint::of(RobotId{2}));
  expect_newest(*a, MessageKind::proxy_graph, "for alpha");
  expect_newest(*b, MessageKind::proxy_graph, "for bravo");
  EXPECT_TRUE(receive(*c).empty());
}

TEST_P(PortConformance, EveryViewerSeesTheNewestMissionStatusALateOneTheLast) {
  const auto hub = network->connect(server);
  auto one = network->connect(Endpoint::viewer(1));
  const auto two = network->connect(Endpoint::viewer(2)), robot = network->connect(alpha);
  EXPECT_TRUE(receive(*one).empty());
  for (const char* status : {"1", "2"})
    send(*hub, server, Endpoint::all_viewers(), MessageKind::mission_status, "", status);
  const auto seen = receive(*one, [](const auto& all) { return !all.empty() && *all.back().envelope.bytes == "2"; });
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.back().envelope.from, server);
  EXPECT_EQ(seen.back().envelope.to, Endpoint::viewer(1));
  EXPECT_EQ(*seen.back().envelope.bytes, "2");
  expect_newest(*two, MessageKind::mission_status, "2");
  EXPECT_TRUE(receive(*one).empty());
  EXPECT_TRUE(receive(*robot).empty());
  EXPECT_TRUE(receive(*hub).empty());
  one.reset();
  send(*hub, server, Endpoint::all_viewers(), MessageKind::mission_status, "", "3");
  one = network->connect(Endpoint::viewer(1));
  expect_newest(*one, MessageKind::mission_status, "3");
  expect_newest(*two, MessageKind::mission_status, "3");
}

TEST_P(PortConformance, EveryJobIsDoneByOneOfTheWorkers) {
  const auto hub = network->connect(server);
  const auto one = network->connect(first), two = network->connect(second);
  for (const char* id : {"a", "b", "c", "d", "e"}) send_job(*hub, id);
  Messages done;
  for (int round = 0; round < 5; ++round)
    for (Port* worker : {one.get(), two.get()}) {
      const Messages taken = take(*worker);
      EXPECT_LE(taken.size(), 1U);
      done.insert(taken.begin(), taken.end());
    }
  EXPECT_EQ(done, (Messages{"a", "b", "c", "d", "e"}));
}

TEST_P(PortConformance, AWorkerHasOneJobAtATimeAndLeavesItToOthersWhenItEnds) {
  const auto hub = network->connect(server);
  auto one = network->connect(first);
  for (const char* id : {"a", "b"}) send_job(*hub, id);
  const auto taken = receive(*one, 1);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].envelope.kind, MessageKind::job);
  one->still_busy(taken[0].ticket);
  EXPECT_TRUE(receive(*one).empty());
  const auto two = network->connect(second);
  Messages done = take(*two, 1);
  EXPECT_EQ(done.size(), 1U);
  EXPECT_TRUE(receive(*two).empty());
  one.reset();
  done.merge(take(*two, 1));
  EXPECT_EQ(done, (Messages{"a", "b"}));
}

TEST_P(PortConformance, BestEffortIsHeardOnceByWhoIsThere) {
  const auto robot = network->connect(alpha);
  auto hub = network->connect(server);
  network->settle();
  send(*robot, alpha, server, MessageKind::status, "", "here");
  expect_newest(*hub, MessageKind::status, "here");
  hub.reset();
  send(*robot, alpha, server, MessageKind::status, "", "nobody listens");
  network->settle();
  hub = network->connect(server);
  EXPECT_TRUE(receive(*hub).empty());
}

TEST_P(PortConformance, WorkersAskTheServerForSubmapsAndGetThemAllEachItsOwn) {
  const Endpoint asker = Endpoint::worker(2);
  const auto one = network->connect(Endpoint::worker(1)), two = network->connect(asker), hub = network->connect(server);
  network->settle();
  send(*two, asker, server, MessageKind::submap_request, "", "which");
  const std::vector<Received> asked = receive(*hub, 1);
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked[0].envelope.from, asker);
  for (const char* copy : {"first", "second", "third"}) send(*hub, server, asker, MessageKind::submap_copy, "", copy);
  std::set<std::string> came;
  for (const Received& message : receive(*two, 3)) {
    EXPECT_EQ(message.envelope.kind, MessageKind::submap_copy);
    EXPECT_EQ(message.envelope.from, server);
    came.insert(*message.envelope.bytes);
  }
  EXPECT_EQ(came, (std::set<std::string>{"first", "second", "third"}));
  EXPECT_TRUE(one->receive().empty());
}

TEST_P(PortConformance, SentAgainBeforeItHasLeftItComesOnce) {
  const auto robot = network->connect(alpha), hub = network->connect(server);
  network->settle();
  network->cut();
  for (int i = 0; i < 3; ++i)
    for (const char* id : {"a", "a/b"}) send_submap(*robot, id);
  network->mend();
  Messages heard;
  for (int round = 0; round < 50 && heard.size() < 2; ++round) heard.merge(take(*hub));
  heard.merge(take(*hub));
  EXPECT_EQ(heard, (Messages{"a", "a/b"}));
}

TEST_P(PortConformance, WithoutContactNothingWaitsAndNothingIsLost) {
  const auto robot = network->connect(alpha), hub = network->connect(server);
  network->settle();
  network->cut();
  const auto begin = std::chrono::steady_clock::now();
  Messages sent;
  for (int i = 0; i < 200; ++i) {
    const std::string id = std::to_string(i);
    if (robot->send({alpha, server, MessageKind::submap, id, std::make_shared<const std::string>(20'000, 'x')}))
      sent.insert(id);
    EXPECT_TRUE(robot->receive().empty());
  }
  send(*hub, server, alpha, MessageKind::proxy_graph, "", "graph");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));  // 400 calls, none waits
  EXPECT_FALSE(sent.empty());
  network->mend();
  Messages heard;
  for (int round = 0; round < 50 && heard.size() < sent.size(); ++round) heard.merge(take(*hub));
  EXPECT_EQ(std::set<std::string>(heard.begin(), heard.end()), std::set<std::string>(sent.begin(), sent.end()));
  expect_newest(*robot, MessageKind::proxy_graph, "graph");
}

const auto kName = [](const auto& of) { return std::string(of.param.name); };
INSTANTIATE_TEST_SUITE_P(Simulated, PortConformance, ::testing::Values(test::kSimulated), kName);
INSTANTIATE_TEST_SUITE_P(Transports, PortConformance, ::testing::ValuesIn(test::kTransports), kName);

}  // namespace port_conformance_test
}  // namespace tutti::bus
