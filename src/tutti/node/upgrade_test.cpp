// SPDX-License-Identifier: BSD-3-Clause
// Robots and servers of different versions: what one of them does not read is kept by who has it, counted, and taken
// later. The next version is simulated by frames that are numbered one higher.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/node/site.hpp"
#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace upgrade_test {

using bus::Endpoint, bus::MessageKind;
using test::raised, test::Site;

TEST(Upgrade, WhatARobotSentBeforeTheServerWasUpgradedIsInTheMapAfterwards) {
  Site site;
  site.walk(100);
  const std::size_t before = site.made();
  site.upgrade_robot(true);
  site.walk(100);
  const std::size_t all = site.made(), sent = site.sent();
  ASSERT_GE(all, before + 2);
  EXPECT_EQ(site.in_map(), before);
  EXPECT_EQ(site.robot().backlog().size(), all - before);
  const MissionStatus status = site.server().mission_status(site.now());
  EXPECT_EQ(status.robots.at(0).unread, all - before);
  EXPECT_EQ(status.robots.at(0).refused, 0U);
  ASSERT_EQ(status.refusals.size(), 1U);
  EXPECT_EQ(status.refusals[0].count, all - before);
  EXPECT_NE(status.refusals[0].last_why.find("this program reads versions"), std::string::npos);
  for (int i = 0; i < 100; ++i) site.pass(10.0);
  EXPECT_EQ(site.sent(), sent);  // it is not sent again and again
  site.start_server();           // of the same version
  EXPECT_EQ(site.sent(), sent + all - before);
  EXPECT_EQ(site.in_map(), before);

  site.upgrade_server(true);
  EXPECT_EQ(site.in_map(), all);
  EXPECT_TRUE(site.robot().backlog().empty());
  EXPECT_EQ(site.server().mission_status(site.now()).robots.at(0).unread, 0U);
}

/// Robot up, server up, and both back, each of these orders; at the end both are up.
TEST(Upgrade, NoOrderLosesASubmap) {
  constexpr int kSteps = 3, kCombinations = 4;
  for (int order = 0; order < kCombinations * kCombinations * kCombinations; ++order) {
    SCOPED_TRACE(order);
    Site site(1e4);  // no map is needed
    site.walk(30);
    for (int step = 0, left = order; step < kSteps; ++step, left /= kCombinations) {
      const bool up = left % 2 == 0;
      if (left % kCombinations < 2)
        site.upgrade_robot(up);
      else
        site.upgrade_server(up);
      site.walk(30);
    }
    site.upgrade_robot(true);
    site.upgrade_server(true);
    site.say();
    site.pass(60.0);
    ASSERT_GE(site.made(), 5U);
    EXPECT_EQ(site.in_map(), site.made());
    EXPECT_TRUE(site.robot().backlog().empty());
    EXPECT_EQ(site.server().mission_status(site.now()).robots.at(0).unread, 0U);
  }
}

/// A stranger's, with a number that the robot has not used yet.
TEST(Upgrade, AnUnreadFrameTakesNobodysPlace) {
  Site site;
  site.walk(100);
  const auto next = static_cast<std::uint32_t>(site.made());
  const SubmapId id{site.robot().agent().chain(), next};
  bus::Envelope forged = test::envelope(test::submap(id.chain, id.index));
  forged.bytes = std::make_shared<const std::string>(raised(*forged.bytes));
  site.deliver(forged);
  EXPECT_EQ(site.server().mission_status(site.now()).robots.at(0).unread, 1U);
  site.walk(100);
  EXPECT_EQ(site.in_map(), site.made());
  EXPECT_EQ(site.server().mission_status(site.now()).robots.at(0).unread, 0U);
}

TEST(Upgrade, AnOlderRobotSaysWhatItCannotReadAndGoesOn) {
  Site site;
  site.walk(100);
  const auto heard = site.robot().agent().map_age();
  const std::string receipt = wire::encode(Receipt{.robot = Site::kRobot});
  const std::string graph = wire::encode(ProxyGraphMessage{.graph = {.epoch = heard.first, .revision = 99}});
  const auto hear = [&](MessageKind kind, const std::string& bytes) {
    return site.robot().receive(
        {Endpoint::server(), Endpoint::of(Site::kRobot), kind, {}, std::make_shared<const std::string>(bytes)},
        site.now());
  };
  for (const auto& [kind, bytes] : {std::pair(MessageKind::receipt, receipt), {MessageKind::proxy_graph, graph}}) {
    EXPECT_EQ(site.robot().status(site.now()).trouble, "");
    for (const char* count : {"(1 so far)", "(2 so far)"}) {
      const Step step = hear(kind, raised(bytes));
      ASSERT_EQ(step.events.size(), 1U);
      EXPECT_TRUE(std::holds_alternative<MessageRefused>(step.events[0].what));
      EXPECT_TRUE(step.writes.empty());
      EXPECT_NE(site.robot().status(site.now()).trouble.find(count), std::string::npos);
    }
    hear(kind, bytes);
  }
  EXPECT_EQ(site.robot().status(site.now()).trouble, "");
}

/// As when a newer server has had the map, and an older one gets it back.
TEST(Upgrade, RowsOfANewerVersionAreLeftAloneAndReported) {
  const ChainId chain{RobotId{0}, 7};
  const auto verifier = std::make_shared<test::EvenVerifier>();
  storage::MemoryStore store(storage::map_schema());
  const auto open = [&] { return ServerNode::open({chain.robot}, verifier, {}, 1000, store).value(); };
  {
    const auto server = open();
    const auto does = [&](const Step& step) { ASSERT_TRUE(store.commit(step.writes).has_value()); };
    does(server->resume({}));
    WorkerNode worker(Endpoint::worker(0), verifier, SubmapFrames::of(store));
    for (std::uint32_t i = 0; i < 5; ++i) {
      const Step step = server->receive(test::envelope(test::submap(chain, i)), {});
      does(step);
      for (const bus::Envelope& job : step.messages)
        if (job.kind == MessageKind::job)
          for (const bus::Envelope& verdicts : worker.receive(job, {}).messages) does(server->receive(verdicts, {}));
    }
  }
  const SubmapPair pair{{chain, 0}, {chain, 2}};
  ASSERT_TRUE(store.commit(std::vector<storage::Write>{
      {"decisions", key_of(pair), raised(wire::encode(ClosureDecision{.closure = "robot_0/0-robot_0/2"}))},
      {"meta", "refused/0", raised(wire::encode(Receipt{.robot = chain.robot}))}}));
  std::vector<storage::Write> newer;
  for (const char* table : {"submaps", "verdicts", "answers"}) {
    auto rows = store.tables().at(table);
    ASSERT_FALSE(rows.empty()) << table;
    newer.push_back({table, rows.rbegin()->first, raised(rows.rbegin()->second)});
  }
  ASSERT_TRUE(store.commit(newer).has_value());
  const auto before = store.tables();

  const auto server = open();
  const Step step = server->resume({});
  std::size_t reported = 0;
  for (const Event& event : step.events)
    if (const auto* refused = std::get_if<MessageRefused>(&event.what)) {
      ++reported;
      EXPECT_NE(refused->why.find("1 rows of the map's table"), std::string::npos) << refused->why;
    }
  EXPECT_EQ(reported, 5U);
  EXPECT_EQ(server->mission_status({}).refusals.size(), 5U);
  EXPECT_EQ(server->map_server().state().submaps.size(), 4U);
  for (const bus::Envelope& message : step.messages)
    if (message.kind == MessageKind::receipt) {
      EXPECT_TRUE(wire::decode_receipt(*message.bytes)->contains({chain, 4}));  // it lies in the map
    }
  for (const storage::Write& write : step.writes) EXPECT_EQ(write.table, "meta");
  for (const storage::Write& write : step.writes) EXPECT_NE(write.key, "refused/0");
}

TEST(Upgrade, AServerCountsWhatItCannotReadOfAnybodyAndGoesOn) {
  Site site;
  site.walk(50);
  const std::size_t before = site.in_map();
  const auto hear = [&](Endpoint from, MessageKind kind, const std::string& bytes) {
    return site.server().receive(
        {from, Endpoint::server(), kind, "1/2", std::make_shared<const std::string>(raised(bytes))}, site.now());
  };
  const Endpoint worker = Endpoint::worker(4), robot = Endpoint::of(Site::kRobot);
  for (const Step& step :
       {hear(robot, MessageKind::status, wire::encode(NodeStatus{.name = "gamma"})),
        hear(worker, MessageKind::status, wire::encode(NodeStatus{.name = "worker_4"})),
        hear(worker, MessageKind::verdicts, wire::encode(Verdicts{.job = "1"})),
        hear(Endpoint::viewer(0), MessageKind::decision, wire::encode(ClosureDecision{.closure = "a"}))}) {
    ASSERT_EQ(step.events.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<MessageRefused>(step.events[0].what));
    EXPECT_TRUE(step.writes.empty());
    EXPECT_TRUE(step.messages.empty());
  }
  EXPECT_EQ(site.server().mission_status(site.now()).refusals.size(), 4U);
  site.walk(100);
  EXPECT_GT(site.in_map(), before);
}

/// In a map that has been there since the first of them.
TEST(Upgrade, SubmapsOfEveryVersionAreInTheMap) {
  for (unsigned version = 1; version <= wire::versions(MessageKind::submap).current; ++version) {
    SCOPED_TRACE(version);
    const std::string file = "src/tutti/wire/testdata/submap_v" + std::to_string(version) + ".bin";
    const auto frame = read_file(tutti::test::source_path(file).string());
    ASSERT_TRUE(frame.has_value()) << frame.error().message;
    const SubmapId id{{RobotId{2}, 1234567890123U}, 16};
    storage::MemoryStore::Tables map;
    map["submaps"][key_of(id)] = *frame;
    map["meta"]["map"] = storage::key_of({9, 3, 1, 2});
    const storage::MemoryStore store(storage::map_schema(), map);
    const auto server = ServerNode::open({id.chain.robot}, std::make_shared<test::EvenVerifier>(), {}, 1000, store);
    ASSERT_TRUE(server.has_value()) << server.error().message;
    EXPECT_TRUE((*server)->map_server().state().submaps.contains(id));
  }
}

/// It answers, and pauses so that another gets it; what it can read it does afterwards.
TEST(Upgrade, AnOlderWorkerGivesAJobBackAndGoesOn) {
  const ChainId chain{RobotId{0}, 7};
  const Job job{.id = "1/0", .pairs = {{{chain, 0}, {chain, 2}}}, .verifier = test::EvenVerifier().id()};
  const RefinementJob refinement{.id = "1/1", .revision = 1};
  const auto envelope = [](MessageKind kind, std::string id, std::string bytes) {
    return bus::Envelope{Endpoint::server(), Endpoint::worker(1), kind, std::move(id),
                         std::make_shared<const std::string>(std::move(bytes))};
  };
  WorkerNode worker(Endpoint::worker(1), std::make_shared<test::EvenVerifier>(), std::make_shared<FrameCache>(1 << 20));
  Timestamp now;
  const auto rests = [&] {
    EXPECT_TRUE(worker.holds_job());
    EXPECT_EQ(worker.next_timer(), now + WorkerNode::kRest_s);
    now = now + WorkerNode::kRest_s;
    EXPECT_TRUE(worker.on_timer(now).messages.empty());
    EXPECT_FALSE(worker.holds_job());
  };
  Step step = worker.receive(envelope(MessageKind::job, "1/0", raised(wire::encode(job))), now);
  EXPECT_EQ(step.events.size(), 1U);
  Verdicts answer = wire::decode_verdicts(*step.messages.at(0).bytes).value();
  EXPECT_TRUE(answer.cannot);
  EXPECT_EQ(answer.job, "1/0");
  EXPECT_NE(answer.why.find("this program reads versions"), std::string::npos) << answer.why;
  rests();

  step = worker.receive(envelope(MessageKind::refinement_job, "1/1", raised(wire::encode(refinement))), now);
  EXPECT_TRUE(wire::decode_refinement(*step.messages.at(0).bytes)->cannot);
  EXPECT_EQ(wire::decode_refinement(*step.messages.at(0).bytes)->job, "1/1");
  rests();

  step = worker.receive(envelope(MessageKind::job, "1/0", wire::encode(job)), now);
  EXPECT_EQ(step.messages.size(), 1U);  // it asks
  const SubmapCopy newer{{chain, 0}, raised(wire::encode(test::submap(chain, 0)))};
  step = worker.receive(envelope(MessageKind::submap_copy, "1/0", wire::encode(newer)), now);
  answer = wire::decode_verdicts(*step.messages.at(0).bytes).value();
  EXPECT_TRUE(answer.cannot);
  EXPECT_EQ(answer.failed, job.pairs);
  EXPECT_NE(answer.why.find(to_string(newer.id)), std::string::npos) << answer.why;
  rests();

  static_cast<void>(worker.receive(envelope(MessageKind::job, "1/0", wire::encode(job)), now));
  for (const std::uint32_t index : {0U, 2U}) {
    const SubmapCopy copy{{chain, index}, wire::encode(test::submap(chain, index))};
    step = worker.receive(envelope(MessageKind::submap_copy, "1/0", wire::encode(copy)), now);
  }
  EXPECT_EQ(wire::decode_verdicts(*step.messages.at(0).bytes)->verdicts.size(), 1U);
}

/// The server's own worker never pauses for others, and does the jobs behind it.
TEST(Upgrade, AJobOfANewerVersionDoesNotHaltTheServersOwnWorker) {
  const ChainId chain{RobotId{0}, 7};
  const std::string bytes = raised(wire::encode(Job{.id = "9/0", .pairs = {{{chain, 0}, {chain, 2}}}}));
  WorkerNode worker(Endpoint::worker(0), std::make_shared<test::EvenVerifier>(), std::make_shared<FrameCache>(1 << 20));
  worker.rest_for(0.0);
  const Step step = worker.receive(
      {Endpoint::server(), Endpoint::worker(0), MessageKind::job, "9/0", std::make_shared<const std::string>(bytes)},
      {});
  EXPECT_EQ(step.messages.size(), 1U);
  EXPECT_FALSE(worker.holds_job());
}

}  // namespace upgrade_test
}  // namespace tutti::node
