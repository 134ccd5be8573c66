// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_names.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace tutti::bus {
namespace nats_names_test {

const Endpoint kServer = Endpoint::server();
const Endpoint kRobot = Endpoint::of(RobotId{3});
const Endpoint kWorker = Endpoint::worker(7);

TEST(NatsNames, SubjectsSayWhoseMessageItIs) {
  const auto subject = [](Endpoint from, Endpoint to, MessageKind kind) {
    return subject_of("m1", {.from = from, .to = to, .kind = kind});
  };
  EXPECT_EQ(subject(kRobot, kServer, MessageKind::submap), "mission.m1.robot.3.submap");
  EXPECT_EQ(subject(kWorker, kServer, MessageKind::verdicts), "mission.m1.worker.7.verdicts");
  EXPECT_EQ(subject(kWorker, kServer, MessageKind::refinement), "mission.m1.worker.7.refinement");
  EXPECT_EQ(subject(kWorker, kServer, MessageKind::status), "mission.m1.worker.7.status");
  for (const MessageKind kind : {MessageKind::job, MessageKind::refinement_job})
    EXPECT_EQ(subject(kServer, Endpoint::any_worker(), kind), "mission.m1.jobs.loop");
  EXPECT_EQ(subject(kServer, kRobot, MessageKind::proxy_graph), "$KV.GRAPH_m1.robot.3.proxy_graph");
  EXPECT_EQ(subject(kServer, kRobot, MessageKind::receipt), "$KV.GRAPH_m1.robot.3.receipt");
  EXPECT_EQ(subject(kWorker, kServer, MessageKind::submap_request), "mission.m1.worker.7.submap_request");
  EXPECT_EQ(subject(kServer, kWorker, MessageKind::submap_copy), "mission.m1.worker.7.submap_copy");
  for (const MessageKind kind : {MessageKind::submap, MessageKind::status, MessageKind::proxy_graph}) {
    const auto address = address_of(subject(kRobot, kRobot, kind));
    ASSERT_TRUE(address.has_value());
    EXPECT_EQ(address->end, kRobot);
    EXPECT_EQ(address->kind, kind);
  }
  EXPECT_EQ(address_of("mission.m1.worker.7.verdicts")->end, kWorker);
  for (const Endpoint viewer : {Endpoint::all_viewers(), Endpoint::viewer(5)})
    EXPECT_EQ(subject(kServer, viewer, MessageKind::mission_status), "$KV.GRAPH_m1.viewer.0.mission_status");
  EXPECT_EQ(address_of("$KV.GRAPH_m1.viewer.0.mission_status")->end, Endpoint::all_viewers());
}

TEST(NatsNames, WhatIsNotOursIsNothing) {
  for (const char* subject : {"", "submap", "mission.m1.jobs.loop", "mission.m1.robot.x.submap", "a.robot.3.apples",
                              "a.robot.-3.submap", "a.robot.99999999999.submap", "a.operator..decision",
                              "a.operator.anna.submap", "a.server.3.submap", "robot..submap"})
    EXPECT_FALSE(address_of(subject)) << subject;
  for (const char* id : {"", "/", "submap/0.1", "submap/a/0.0", "submap/a/1.1", "submap/a/0.129", "submap/a/0.1.2",
                         "submap/a/-1.2", "apple/a/0.1", "submap/a/", "submap/a/0", "submap/a/ 0.1"})
    EXPECT_FALSE(part_of(id)) << id;
  for (const char* mission : {"", "a.b", "a b", "a>", "*", "an_unreasonably_long_name_for_a_mission"})
    EXPECT_FALSE(is_mission_name(mission)) << mission;
  EXPECT_TRUE(is_mission_name("Tunnel-2_b"));
}

TEST(NatsNames, TheContentStandsInFrontOfThePart) {
  const Part part{MessageKind::submap, "3/1700000000/4", 0, 2, 0xc0ffee00c0ffeeU};
  EXPECT_EQ(to_string(part), "submap/3/1700000000/4/h00c0ffee00c0ffee/0.2");
  EXPECT_EQ(part_of(to_string(part)), part);
  EXPECT_FALSE(part_of("submap/3/1700000000/4/0.2"));
  EXPECT_FALSE(part_of("submap/3/h00c0ffee/0.2"));
}

RC_GTEST_PROP(NatsNames, AMessageIsPutTogetherFromItsPartsInAnyOrderAnyOfThemAgain, ()) {
  const auto count = *rc::gen::inRange<std::uint32_t>(1, 10);
  const auto id = *rc::gen::element<std::string>("a", "3/17/4", "x/0.1/y:_-.", "");
  const auto content = *rc::gen::element<std::uint64_t>(0U, ~0ULL, 0xc0ffeeU);
  std::vector<std::string> bytes(count);
  std::vector<std::uint32_t> order;
  std::string all;
  for (std::uint32_t i = 0; i < count; ++i) {
    all += bytes[i] = *rc::gen::arbitrary<std::string>();
    for (int again = *rc::gen::inRange(1, 3); again > 0; --again) order.push_back(i);
  }
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[*rc::gen::inRange<std::size_t>(0, i)]);
  Assembly assembly;
  std::vector<bool> seen(count, false);
  std::string put_together;
  for (std::size_t step = 0; step < order.size(); ++step) {
    const Part part{MessageKind::verdicts, id, order[step], count, content};
    RC_ASSERT(part_of(to_string(part)) == part);
    const bool before = assembly.complete() && step > 0;
    RC_ASSERT(assembly.add(part, bytes[order[step]], std::to_string(step)));
    seen[order[step]] = true;
    RC_ASSERT(assembly.complete() == (std::ranges::find(seen, false) == seen.end()));
    if (assembly.complete() && !before) put_together = assembly.take_bytes();
    RC_ASSERT(assembly.replies().at(order[step]) == std::to_string(step));
    RC_ASSERT(!assembly.add({MessageKind::verdicts, id, 0, count + 1, {}}, "wrong", "wrong"));
  }
  RC_ASSERT(put_together == all);
}

TEST(NatsNames, WhatAWorkerSaysOfAJobIsReadOrRefused) {
  EXPECT_EQ(settle_subject("cave", "7"), "mission.cave.worker.7.settle");
  EXPECT_EQ(settler_of(settle_subject("cave", "7")), 7U);
  const std::string reply = "$JS.ACK.JOBS_cave.workers.1.42.3.1700000000000000000.5";
  const auto said = settlement_of("ab12 " + reply + " +WPI", "JOBS_cave");
  ASSERT_TRUE(said);
  EXPECT_EQ(said->secret, "ab12");
  EXPECT_EQ(said->reply, reply);
  EXPECT_EQ(said->verb, "+WPI");
  EXPECT_EQ(said->sequence, 42U);
  EXPECT_FALSE(settlement_of("ab12 " + reply + " +WPI", "SUBMAPS_cave"));
  for (const std::string& wrong :
       {std::string(), reply, "ab12 " + reply, "ab12 " + reply + " +NXT", "ab12  " + reply + " +ACK",
        "ab12 " + reply + ".1 +ACK", std::string("ab12 $JS.ACK.JOBS_cave.workers.1.x.3.1.5 +ACK"),
        std::string("ab12 $JS.API.JOBS_cave.workers.1.42.3.1.5 +ACK"),
        std::string("ab12 $JS.ACK.JOBS_cave.others.1.42.3.1.5 +ACK"),
        std::string("ab12 $JS.ACK.JOBS_cave.workers.1.42.*.1.5 +ACK"),
        std::string("ab12 $JS.ACK.JOBS_cave.workers.1.42..1.5 +ACK")})
    EXPECT_FALSE(settlement_of(wrong, "JOBS_cave")) << wrong;
}

}  // namespace nats_names_test
}  // namespace tutti::bus
