// SPDX-License-Identifier: BSD-3-Clause
// A server that has started again on less than its robots have sent it.
#include <gtest/gtest.h>

#include "support/node/site.hpp"
#include "tutti/node/worker_node.hpp"

namespace tutti::node {
namespace incarnation_test {

using test::Site;

TEST(Incarnation, AnOlderMapThatIsPutBackGetsWhatItLacksAndIsHeardAtOnce) {
  Site site;
  site.walk(100);
  const auto monday = site.map();
  const std::size_t before = site.in_map();
  site.walk(200);
  const std::size_t all = site.made();
  ASSERT_GE(before, 2U);
  ASSERT_GE(all, before + 4);
  ASSERT_EQ(site.in_map(), all);
  const auto heard = site.robot().agent().map_age();
  const std::size_t swallowed = site.swallowed();

  site.put_back(monday);
  const auto forgotten = site.events_of<SubmapsForgotten>();
  ASSERT_EQ(forgotten.size(), 1U);
  EXPECT_EQ(forgotten[0].robot, Site::kRobot);
  EXPECT_EQ(forgotten[0].submaps, all - before);
  EXPECT_EQ(site.in_map(), all);
  EXPECT_EQ(site.swallowed(), swallowed);
  site.pass(20.0);
  EXPECT_LT(site.server().map_server().state().revision, heard.second);
  EXPECT_EQ(site.robot().agent().map_age().second, site.server().map_server().state().revision);
  EXPECT_EQ(site.events_of<SubmapsForgotten>().size(), 1U);
  EXPECT_TRUE(site.events_of<MessageRefused>().empty()) << site.events_of<MessageRefused>().front().why;
}

TEST(Incarnation, AStateThatIsLostWithoutAClockComesBack) {
  Site site;
  site.walk(200);
  site.start_robot();  // its archive lies on its disk
  const std::size_t all = site.made();
  site.set_epoch(5);  // nanoseconds since its board was switched on
  site.put_back({});
  EXPECT_EQ(site.in_map(), all);
  site.pass(20.0);
  EXPECT_EQ(site.robot().agent().map_age(), std::pair(std::uint64_t{5}, std::uint64_t{1}));
  EXPECT_TRUE(site.robot().backlog().empty());
  site.start_robot();  // which hears what the bus has kept, and knows it
  EXPECT_EQ(site.robot().agent().map_age(), std::pair(std::uint64_t{5}, std::uint64_t{1}));
  site.walk(100);
  EXPECT_EQ(site.in_map(), site.made());
  EXPECT_GT(site.robot().agent().map_age().second, 1U);
}

TEST(Incarnation, ThatHasTheWholeMapGetsNothingAgain) {
  Site site;
  site.walk(200);
  site.pass(server::ServerConfig{}.unchanged_every_s);  // by then it has the last map, which corrects nothing
  const std::size_t updates = site.events_of<RobotUpdated>().size();
  for (int start = 0; start < 5; ++start) {
    site.start_server();
    site.start_robot();
    site.say();
    site.pass(100.0);
  }
  EXPECT_EQ(site.sent(), site.made());
  EXPECT_EQ(site.events_of<RobotUpdated>().size(), updates);  // the graph is the one that it knows
  EXPECT_TRUE(site.events_of<SubmapsForgotten>().empty());
}

TEST(Incarnation, TheArchiveIsBoundedAndTheNewestStay) {
  Site site;
  site.walk(200);
  const std::size_t all = site.made(), bytes = site.robot().archive().begin()->second;
  ASSERT_EQ(site.rows("archive"), all);
  ASSERT_EQ(site.rows("outbox"), all);
  site.keep(4 * bytes);
  site.walk(50);  // the next submap makes room
  const std::size_t kept = site.robot().archive().size();
  ASSERT_GE(kept, 2U);
  ASSERT_LT(kept, all);
  EXPECT_EQ(site.rows("archive"), kept);
  EXPECT_EQ(site.rows("outbox"), kept);
  const SubmapId newest = site.robot().archive().rbegin()->first;
  site.put_back({});
  EXPECT_EQ(site.in_map(), kept);
  EXPECT_TRUE(site.server().map_server().state().submaps.contains(newest));
}

TEST(Incarnation, JobsOfAnOlderMapHaveNamesOfTheirOwn) {
  const ChainId chain{RobotId{0}, 7};
  std::set<std::string> names;
  for (const std::uint32_t incarnation : {11U, 12U}) {
    storage::MemoryStore store(storage::map_schema());  // the same again
    const auto server = ServerNode::open({chain.robot}, std::make_shared<test::EvenVerifier>(),
                                         {.incarnation = incarnation}, 1000, store)
                            .value();
    WorkerNode worker(bus::Endpoint::worker(0), std::make_shared<test::EvenVerifier>(), SubmapFrames::of(store));
    const auto does = [&](const Step& step) {
      EXPECT_TRUE(store.commit(step.writes).has_value());
      return step;
    };
    for (std::uint32_t i = 0; i < 4; i += 2)
      for (const bus::Envelope& message : does(server->receive(test::envelope(test::submap(chain, i)), {})).messages) {
        if (message.kind != bus::MessageKind::job) continue;
        EXPECT_TRUE(names.insert(message.id).second) << message.id;
        for (const bus::Envelope& verdicts : worker.receive(message, {}).messages) does(server->receive(verdicts, {}));
        EXPECT_EQ(server->mission_status({}).pending_jobs, 0U);
      }
  }
  EXPECT_EQ(names.size(), 2U);
}

TEST(MessageId, HasTheIncarnationWhereThereIsOne) {
  const SubmapId id{{RobotId{3}, 1'700'000'000'000'000'000}, 17};
  for (const std::uint32_t incarnation : {0U, 1U, 0xffffffffU}) EXPECT_EQ(submap_of(message_id(id, incarnation)), id);
  EXPECT_EQ(message_id(id), "3/1700000000000000000/17");
  EXPECT_EQ(message_id(id, 0x2a), "3/1700000000000000000/17/0000002a");
  for (const char* bad : {"", "3", "3/7", "3/7/", "3/7/8/", "3/7/8/x", "3/7/8/9/", "3/7/8/123456789", "/7/8", "3/7/-8"})
    EXPECT_FALSE(submap_of(bad).has_value()) << bad;
}

}  // namespace incarnation_test
}  // namespace tutti::node
