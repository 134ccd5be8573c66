// SPDX-License-Identifier: BSD-3-Clause
// Members and strangers try what is not theirs to do, on a real bus: nothing of it arrives, each attempt is in what
// the bus reports, and those who belong go on.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/pki/pki_bus.hpp"
#include "tutti/base/random.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/mission_lease.hpp"

namespace tutti::pki {
namespace intruders_test {

using bus::BusRole;
using bus::Endpoint;
using bus::MessageKind;
using test::bytes;
using test::within;

/// One that connects, and sends what it likes or nothing.
class Stranger {
 public:
  explicit Stranger(int port) : file_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(file_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Stranger() { close(file_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  [[nodiscard]] bool connected() const { return connected_; }
  /// False: the bus has had enough.
  [[nodiscard]] bool say(const std::string& text) const {
    return send(file_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  [[nodiscard]] bool is_closed() const {
    char any[4096];
    const ssize_t got = recv(file_, any, sizeof any, MSG_DONTWAIT);
    return got == 0 || (got < 0 && errno != EAGAIN);
  }

 private:
  int file_;
  bool connected_ = false;
};

class Intruders : public test::PkiBus {
 protected:
  void SetUp() override {
    test::PkiBus::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    start_bus();
    alpha_ = add(BusRole::robot, "alpha", 3);
    bravo_ = add(BusRole::robot, "bravo", 4);
    worker_ = add(BusRole::worker, "w");
    anna_ = add(BusRole::operates, "anna");
    vera_ = add(BusRole::views, "vera");
    lease_ = bus::MissionLease::open(options(credentials("server")),
                                     bus::LeaseHolder{.host = "base", .state = "/s", .seat = "a"})
                 .value();
    hub_ = open(Endpoint::server(), credentials("server"));
    robot_ = open(Endpoint::of(RobotId{4}), bravo_);
    EXPECT_TRUE(within(20.0, [&] { return hub_->state().connected && robot_->state().connected; }));
    EXPECT_TRUE(lease_->wait(10.0).held);
    static_cast<void>(child_->take_refusals());
  }
  /// Bravo's submap arrives, and nothing else has.
  void expect_all_is_well() {
    static int number = 0;
    const std::string id = "own/" + std::to_string(++number);
    ASSERT_TRUE(robot_->send({Endpoint::of(RobotId{4}), Endpoint::server(), MessageKind::submap, id, bytes(id)}));
    const auto came = heard(*hub_, 1);
    ASSERT_EQ(came.size(), 1U);
    EXPECT_EQ(came.front().id, id);
    EXPECT_EQ(*came.front().bytes, id);
    EXPECT_TRUE(robot_->receive().empty());
    EXPECT_TRUE(lease_->state().held);
    EXPECT_EQ(hub_->state().streams_made_anew, 0U);
    EXPECT_EQ(hub_->state().strange_jobs, 0U);
  }
  /// A busy machine may not get through the handshake within the bus's two seconds, and tries again as a port does.
  [[nodiscard]] std::shared_ptr<bus::NatsConnection> connect(const bus::BusCredentials& who) const {
    auto opened = bus::NatsConnection::open(options(who), "intruder");
    within(30.0, [&] { return opened || (opened = bus::NatsConnection::open(options(who), "intruder")); });
    EXPECT_TRUE(opened.has_value()) << opened.error().message;
    return opened ? *opened : nullptr;
  }
  /// Publishes to these subjects, or subscribes to them, and expects the bus to refuse each, and to report who it was.
  void expect_refused(const bus::BusCredentials& who, const std::string& verb,
                      const std::vector<std::string>& subjects) {
    const auto connection = connect(who);
    ASSERT_NE(connection, nullptr);
    std::set<std::string> expected;
    for (const std::string& subject : subjects) {
      expected.insert(verb + " " + subject);
      const bool publishes = verb == "publish";
      EXPECT_TRUE(publishes ? connection->publish(subject, "_INBOX.any", "submap/4/1/9/0.1", "forged").has_value()
                            : connection->subscribe(subject).has_value());
    }
    connection->flush();
    std::set<std::string> reported;
    within(10.0, [&] {
      for (const bus::BusRefusal& refusal : rights_refused()) {
        EXPECT_EQ(refusal.key, who.key.open) << refusal.what;
        reported.insert(refusal.what);
      }
      return reported.size() >= expected.size();
    });
    EXPECT_EQ(reported, expected);
    EXPECT_NE(connection->denied(), "");
  }
  [[nodiscard]] int port() const { return std::atoi(child_->url().substr(child_->url().rfind(':') + 1).c_str()); }

  bus::BusCredentials alpha_, bravo_, worker_, anna_, vera_;
  std::unique_ptr<bus::MissionLease> lease_;
  std::unique_ptr<bus::Port> hub_, robot_;
};

/// Subjects that make, change and remove what the bus keeps, and the lease of the server.
const std::vector<std::string> kOfTheServerAlone{"$JS.API.STREAM.DELETE.SUBMAPS_cave",
                                                 "$JS.API.STREAM.PURGE.SUBMAPS_cave",
                                                 "$JS.API.STREAM.UPDATE.VERDICTS_cave",
                                                 "$JS.API.STREAM.CREATE.OWN",
                                                 "$JS.API.STREAM.MSG.GET.SUBMAPS_cave",
                                                 "$JS.API.STREAM.MSG.DELETE.SUBMAPS_cave",
                                                 "$JS.API.DIRECT.GET.SUBMAPS_cave",
                                                 "$JS.API.CONSUMER.DELETE.SUBMAPS_cave.server",
                                                 "$JS.API.CONSUMER.DURABLE.CREATE.SUBMAPS_cave.server",
                                                 "$JS.API.CONSUMER.CREATE.SUBMAPS_cave",
                                                 "$JS.API.CONSUMER.MSG.NEXT.SUBMAPS_cave.server",
                                                 "$JS.API.CONSUMER.DURABLE.CREATE.JOBS_cave.workers",
                                                 "$JS.ACK.SUBMAPS_cave.server.1.1.1.1.0",
                                                 "$JS.ACK.JOBS_cave.workers.1.1.1.1.0",
                                                 "$KV.TUTTI_SERVERS.cave",
                                                 "$KV.GRAPH_cave.robot.3.receipt",
                                                 "$KV.GRAPH_cave.robot.4.receipt",
                                                 "$KV.GRAPH_cave.robot.4.proxy_graph",
                                                 "$KV.GRAPH_cave.viewer.0.mission_status",
                                                 "mission.cave.jobs.loop",
                                                 "mission.cave.worker.1.submap_copy",
                                                 "_INBOX.server.0.anything"};
const std::vector<std::string> kOfOthers{
    "mission.cave.robot.4.submap",          "mission.cave.robot.4.status",   "mission.cave.worker.2.status",
    "mission.cave.worker.2.verdicts",       "mission.cave.worker.2.settle",  "mission.cave.viewer.0.decision",
    "mission.cave.operator.berta.decision", "mission.tunnel.robot.3.submap", "mission.tunnel.worker.1.verdicts"};

TEST_F(Intruders, NobodyButTheServerTouchesStreamsReceiptsAndTheLease) {
  for (const auto* who : {&alpha_, &worker_, &anna_, &vera_}) {
    expect_refused(*who, "publish", kOfTheServerAlone);
    expect_refused(*who, "publish", kOfOthers);
  }
  expect_all_is_well();
}

/// Nor does an answer of the bus become one, which whoever asks can have sent anywhere.
TEST_F(Intruders, NobodyButAnOperatorPublishesAMap) {
  const std::string head = "mission.cave.map.0.head";
  for (const auto* who : {&alpha_, &worker_, &vera_}) expect_refused(*who, "publish", {head, "mission.cave.map.1.17"});
  const auto desk = bus::open_maps(options(anna_)).value(), robot = bus::open_maps(options(alpha_)).value();
  EXPECT_EQ(robot->read("0.head").value(), std::nullopt);
  ASSERT_TRUE(desk->write("0.head", "signed").has_value());
  EXPECT_EQ(robot->read("0.head").value(), "signed");
  const auto connection = connect(alpha_);
  for (const char* key : {"0.head", "0.nothing"})
    ASSERT_TRUE(connection->publish("$JS.API.DIRECT.GET.MAPS_cave.mission.cave.map." + std::string(key), head, "", ""));
  connection->flush();
  expect_all_is_well();
  EXPECT_EQ(robot->read("0.head").value(), "signed");
  EXPECT_TRUE(rights_refused().empty());
}

TEST_F(Intruders, NobodyReadsWhatIsOthers) {
  for (const auto* who : {&alpha_, &worker_, &anna_, &vera_})
    expect_refused(
        *who, "subscribe",
        {">", "mission.>", "mission.cave.robot.4.submap", "mission.*.*.*.status", "$KV.>", "$KV.GRAPH_cave.robot.4.*",
         "_INBOX.>", "_INBOX.robot.4.>", "_INBOX.server.0.>", "$JS.>", "$SYS.>"});
  expect_all_is_well();
}

TEST_F(Intruders, AViewerDoesNotDecideAndAnOperatorOnlyUnderOneName) {
  expect_refused(vera_, "publish", {"mission.cave.operator.vera.decision", "mission.cave.operator.anna.decision"});
  const auto desk = open(Endpoint::viewer(1), anna_);
  ASSERT_TRUE(
      desk->send({Endpoint::viewer(1), Endpoint::server(), MessageKind::decision, "w", bytes("by berta"), "berta"}));
  const auto came = heard(*hub_, 1);
  ASSERT_EQ(came.size(), 1U);
  EXPECT_EQ(came.front().user, "anna");
  expect_all_is_well();
}

/// A robot that sends once more what it has sent, or under the id of another's: of one id the bus takes one.
TEST_F(Intruders, WhatIsReplayedArrivesOnce) {
  const auto connection = connect(alpha_);
  const bus::Envelope submap{Endpoint::of(RobotId{3}), Endpoint::server(), MessageKind::submap, "3/1/1", bytes("own")};
  for (int i = 0; i < 10'000; ++i)
    ASSERT_TRUE(connection->publish(bus::subject_of("cave", submap), "", to_string(bus::whole_part(submap)), "own"));
  connection->flush();
  EXPECT_EQ(heard(*hub_, 1).size(), 1U);
  expect_all_is_well();
}

/// Whoever asks the bus chooses where it answers, and it does not check that subject against their rights. No answer to
/// a member reaches the server's streams, and none is taken for a message of the server or another member.
TEST_F(Intruders, WhatTheBusAnswersIsNobodysMessage) {
  const auto send_text = [&](RobotId robot, MessageKind kind, const std::string& text) {
    ASSERT_TRUE(hub_->send({Endpoint::server(), Endpoint::of(robot), kind, "", bytes(text)}));
  };
  send_text(RobotId{3}, MessageKind::proxy_graph, "of 3");
  send_text(RobotId{4}, MessageKind::proxy_graph, "of 4");
  ASSERT_EQ(heard(*robot_, 1).size(), 1U);  // it listens
  const auto connection = connect(alpha_);
  const std::string value = "$KV.GRAPH_cave.robot.3.", ask = "$JS.API.DIRECT.GET.KV_GRAPH_cave." + value;
  ASSERT_TRUE(within(10.0, [&] {
    const auto own = connection->retained("KV_GRAPH_cave", value + "proxy_graph");
    return own && *own;
  }));
  ASSERT_TRUE(connection->publish(ask + "proxy_graph", "$KV.GRAPH_cave.robot.4.proxy_graph", "", ""));
  EXPECT_TRUE(within(10.0, [&] { return robot_->state().last_error.find("another subject") != std::string::npos; }))
      << robot_->state().last_error;
  EXPECT_TRUE(robot_->receive().empty());
  // That nothing is there is answered with no bytes, which the bus's own subjects take for a request; that a submap is
  // stored is answered with its number, up to which they would remove what is stored.
  send_text(RobotId{4}, MessageKind::receipt, "receipt");
  const bus::Envelope submap{Endpoint::of(RobotId{3}), Endpoint::server(), MessageKind::submap, "3/1/1", bytes("own")};
  std::size_t sent = 0;
  for (const auto* list : {&kOfTheServerAlone, &kOfOthers})
    for (const std::string& subject : *list) {
      if (subject.starts_with("$KV.GRAPH_cave.robot.4.")) continue;  // see above
      auto part = bus::whole_part(submap);
      part.id = std::to_string(++sent);
      ASSERT_TRUE(connection->publish(ask + "nothing", subject, "", ""));
      ASSERT_TRUE(connection->publish(bus::subject_of("cave", submap), subject, to_string(part), "own"));
    }
  connection->flush();
  const auto came = heard(*hub_, sent - 2);  // two are refused: their answers were to be acknowledgements
  EXPECT_EQ(std::ranges::count(came, "own", [](const bus::Envelope& one) { return *one.bytes; }), sent - 2);
  EXPECT_EQ(heard(*robot_, 1).size(), 1U);
  expect_all_is_well();
  std::set<std::string> reported;
  for (const bus::BusRefusal& refusal : rights_refused()) reported.insert(refusal.what);
  EXPECT_EQ(reported, (std::set<std::string>{"be answered at $JS.ACK.JOBS_cave.workers.1.1.1.1.0",
                                             "be answered at $JS.ACK.SUBMAPS_cave.server.1.1.1.1.0"}));
  EXPECT_EQ(hub_->state().strange_settlements, 0U) << "worker 2 has said nothing";
  const auto base = connect(credentials("server"));
  for (const char* stream : {"SUBMAPS_cave", "VERDICTS_cave", "JOBS_cave", "KV_GRAPH_cave"})
    EXPECT_TRUE(base->has_stream(stream).value()) << stream;
}

/// Jobs that wait, and one that another worker has. Who has been given a job knows its secret; another guesses, or has
/// none.
TEST_F(Intruders, AWorkerEndsNoJobsButItsOwn) {
  const auto other = add(BusRole::worker, "thief");
  const auto honest = open(Endpoint::worker(1), worker_);
  const auto job = [](const std::string& id) {
    return bus::Envelope{Endpoint::server(), Endpoint::any_worker(), MessageKind::job, id, bytes(id)};
  };
  ASSERT_TRUE(hub_->send(job("j0")));
  EXPECT_EQ(heard(*honest, 1).size(), 1U);
  ASSERT_TRUE(within(60.0, [&] { return honest->state().waiting_acknowledgements == 0; })) << "the hub listens";
  for (const char* id : {"j1", "j2", "j3"}) ASSERT_TRUE(hub_->send(job(id)));
  std::vector<bus::Received> first;
  ASSERT_TRUE(within(60.0, [&] {
    for (bus::Received& one : honest->receive()) first.push_back(std::move(one));
    return !first.empty() && hub_->state().waiting_messages == 0;
  }));
  const auto thief = connect(other);
  ASSERT_NE(thief, nullptr);
  for (const char* secret : {"", "0", "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"})
    for (int sequence = 2; sequence <= 4; ++sequence)
      for (const char* verb : {"+ACK", "+TERM", "-NAK", "+WPI"})
        ASSERT_TRUE(thief->publish(
            "mission.cave.worker.2.settle", "", "",
            fmt::format("{} $JS.ACK.JOBS_cave.workers.1.{}.{}.1.0 {}", secret, sequence, sequence, verb)));
  for (const char* text : {"", "+ACK", "a b c", "0 $JS.ACK.SUBMAPS_cave.server.1.1.1.1.0 +ACK"})
    ASSERT_TRUE(thief->publish("mission.cave.worker.2.settle", "", "", text));
  thief->flush();
  EXPECT_TRUE(within(60.0, [&] { return hub_->state().strange_settlements >= 40; }))
      << hub_->state().strange_settlements;
  EXPECT_EQ(hub_->state().strange_settler, 2U);
  std::vector<std::string> came;
  EXPECT_TRUE(within(60.0, [&] {
    for (bus::Received& one : honest->receive()) first.push_back(std::move(one));
    for (const bus::Received& one : std::exchange(first, {})) {
      came.push_back(one.envelope.id);
      honest->acknowledge(one.ticket);
    }
    return came.size() == 3 && honest->state().waiting_acknowledgements == 0;
  }));
  EXPECT_EQ(came, (std::vector<std::string>{"j1", "j2", "j3"})) << "each once, in their order";
  EXPECT_EQ(hub_->state().strange_settlements, 40U) << "of the honest one nothing is strange";
  const auto base = connect(credentials("server"));
  EXPECT_TRUE(within(10.0, [&] {
    const auto state = base->read_state("JOBS_cave", "workers");
    return state && *state && (*state)->messages == 0;
  })) << "its own it has ended";
  expect_all_is_well();
}

/// Fifty who begin TLS, a byte now and then: the bus gives all of a handshake two seconds.
TEST_F(Intruders, WhoSpeaksSlowlyHoldsUpNobody) {
  std::string hello("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11);
  hello.resize(512, 'x');
  std::vector<std::unique_ptr<Stranger>> slow;
  for (int i = 0; i < 50; ++i) slow.push_back(std::make_unique<Stranger>(port()));
  std::size_t at = 0;
  EXPECT_TRUE(within(30.0, [&] {
    std::erase_if(slow, [&](const auto& one) { return !one->say(hello.substr(at, 1)) || one->is_closed(); });
    at = std::min(at + 1, hello.size() - 2);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return slow.empty();
  })) << slow.size();
  EXPECT_LT(at, hello.size() - 2) << "nobody had come to the end of the greeting";
  expect_all_is_well();
  EXPECT_EQ(robot_->state().reconnects, 0U);
}

/// 10 MB of garbage, and 500 who send nothing, before and after the bus's first line: it closes them all in time.
TEST_F(Intruders, GarbageAndSilenceEndAtTheDoor) {
  std::vector<std::unique_ptr<Stranger>> silent;
  for (int i = 0; i < 500; ++i) silent.push_back(std::make_unique<Stranger>(port()));
  Rng random(1);
  std::size_t sent = 0, refused = 0;
  while (sent < 10U << 20U) {
    const Stranger one(port());
    ASSERT_TRUE(one.connected());
    std::string text(256U << 10U, '\0');
    for (char& letter : text) letter = static_cast<char>(random.index(256));
    if (!one.say(text)) ++refused;
    sent += text.size();
  }
  expect_all_is_well();
  EXPECT_TRUE(within(30.0, [&] {
    std::erase_if(silent, [](const auto& one) { return one->is_closed(); });
    return silent.empty();
  })) << silent.size();
  std::size_t refused_so_far = 0;
  within(10.0, [&] {
    const auto refusals = child_->take_refusals();
    for (const bus::BusRefusal& refusal : refusals.all) EXPECT_EQ(refusal.key, "");
    refused_so_far += refusals.all.size() + refusals.more;
    return refused_so_far >= 540;
  });
  EXPECT_GE(refused_so_far, 540U) << "500 silent ones and 40 with garbage";
  EXPECT_EQ(robot_->state().reconnects, 0U);
  EXPECT_EQ(hub_->state().reconnects, 0U);
}

}  // namespace intruders_test
}  // namespace tutti::pki
