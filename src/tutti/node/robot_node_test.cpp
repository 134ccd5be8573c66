// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "support/node/submaps.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/base/content_hash.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace robot_node_test {

using bus::Endpoint, bus::MessageKind;
constexpr RobotId kRobot{1};

/// A robot on a store, whose steps are committed.
class RobotNodeTest : public testing::Test {
 protected:
  RobotNodeTest() { restart(); }
  void restart() {
    store_ = std::make_unique<storage::MemoryStore>(storage::robot_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = RobotNode::open(kRobot, 100 + ++starts_, config_, *store_).value();
    resumed_ = done(node_->resume(now_));
  }
  Step done(Step step) {
    EXPECT_TRUE(store_->commit(step.writes).has_value());
    if (!step.writes.empty()) ++transactions_;
    for (const bus::Envelope& message : step.messages) sent_.push_back(message);
    return step;
  }
  /// In mission time that is the recording's, and all timers.
  void walk(int from, int to) {
    for (int i = from; i < to; ++i) {
      now_ = std::max(now_, Timestamp{} + (odometry_[i].stamp - odometry_[0].stamp));
      if (node_->next_timer() && *node_->next_timer() <= now_) done(node_->on_timer(now_));
      done(node_->add(OdometrySample{odometry_[i].stamp, odometry_[i].pose, robot::test::kStepCovariance}, now_));
      if (!node_->agent().wants_scan()) continue;
      PointCloud cloud;
      cloud.points.emplace_back(1.0F * static_cast<float>(i), 5.0F, 1.0F);
      done(node_->add(Scan{odometry_[i].stamp, std::make_shared<const PointCloud>(cloud), {}}, now_));
    }
  }
  Step hear(std::uint64_t revision) {
    return done(
        node_->receive(test::from_server(kRobot, MessageKind::proxy_graph, wire::encode(graph(revision))), now_));
  }
  ProxyGraphMessage graph(std::uint64_t revision) {
    return robot::test::broadcast(node_->agent(), revision, robot::test::kWorld);
  }
  Step confirm(const std::vector<SubmapId>& ids, RobotId robot = kRobot) {
    Receipt receipt{.robot = robot, .stored = {}};
    for (const SubmapId id : ids) receipt.stored[id.chain.session].insert(id.index);
    return done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  }
  [[nodiscard]] std::size_t rows(const char* table) const { return store_->tables().at(table).size(); }

  const Trajectory odometry_ = robot::test::drifting_odometry(200);
  RobotNodeConfig config_;
  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<RobotNode> node_;
  std::size_t transactions_ = 0;
  Step resumed_;
  std::vector<bus::Envelope> sent_;
  std::uint64_t starts_ = 0;
  Timestamp now_;
};

TEST_F(RobotNodeTest, GoesOnFromItsStoreToTheBit) {
  walk(0, 130);
  hear(1);
  walk(130, 160);
  now_ = now_ + config_.journal_period_s;
  done(node_->on_timer(now_));
  const std::string before = wire::encode(node_->agent().state());
  ASSERT_GT(node_->agent().ledger().size(), 0U);
  ASSERT_GT(rows("journal"), 0U);
  restart();
  EXPECT_EQ(wire::encode(node_->agent().state()), before);
  EXPECT_EQ(node_->agent().chain().session, 101U);
  EXPECT_TRUE(hear(1).events.empty());  // known
  walk(155, 200);                       // five samples come again
  EXPECT_EQ(node_->agent().keyframes().size(), 200U);
  done(node_->finish(now_));
  EXPECT_EQ(rows("journal"), 0U);
}

TEST_F(RobotNodeTest, KeepsSubmapsUntilTheServerHasStoredThem) {
  walk(0, 100);
  std::set<SubmapId> all;
  std::size_t bytes = 0;
  for (const auto& [id, size] : node_->backlog()) all.insert(id), bytes += size;
  EXPECT_EQ(node_->status(now_).backlog_submaps, all.size());
  EXPECT_EQ(node_->status(now_).backlog_bytes, bytes);
  ASSERT_GE(all.size(), 4U);
  EXPECT_EQ(rows("outbox"), all.size());
  ASSERT_EQ(sent_.size(), all.size());
  EXPECT_EQ(sent_[1].id, "1/101/1");
  EXPECT_EQ(sent_[1].kind, MessageKind::submap);
  const SubmapId first = *all.begin(), last = *all.rbegin();
  confirm({first, last});
  EXPECT_EQ(rows("outbox"), all.size());
  EXPECT_EQ(rows("archive"), 2U);
  const std::vector<bus::Envelope> before = std::exchange(sent_, {});
  restart();
  ASSERT_EQ(sent_.size(), all.size() - 2);  // the others once more, as they were, the newest first
  EXPECT_EQ(*sent_.back().bytes, *before[1].bytes);
  EXPECT_EQ(sent_.back().id, before[1].id);
  EXPECT_EQ(sent_.front().id, before[before.size() - 2].id);
  confirm({first, last});
  confirm({all.begin(), all.end()});
  EXPECT_TRUE(node_->backlog().empty());
  EXPECT_EQ(node_->archive().size(), all.size());
}

TEST_F(RobotNodeTest, WhatTheServerRefusesForGoodLeavesTheOutboxAndIsReported) {
  walk(0, 100);
  const SubmapId bad = node_->backlog().begin()->first;
  Receipt receipt{.robot = kRobot, .why_refused = "no good"};
  receipt.refuse(bad, content_hash(store_->tables().at("outbox").at(key_of(bad))), 1);
  const bus::Envelope envelope = test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt));
  const Step step = done(node_->receive(envelope, now_));
  EXPECT_FALSE(node_->backlog().contains(bad));
  EXPECT_TRUE(node_->archive().contains(bad));
  ASSERT_EQ(step.events.size(), 1U);
  const std::string why = std::get<MessageRefused>(step.events[0].what).why;
  EXPECT_NE(why.find("1:101/0"), std::string::npos) << why;
  EXPECT_NE(why.find("no good"), std::string::npos) << why;
  EXPECT_TRUE(done(node_->receive(envelope, now_)).events.empty());
}

TEST_F(RobotNodeTest, WhatIsRefusedOfSomebodyElseUnderItsIdStays) {
  walk(0, 100);
  const SubmapId id = node_->backlog().begin()->first;
  Receipt receipt{.robot = kRobot, .why_refused = "no good"};
  receipt.refused[id.chain.session].insert(id.index);
  receipt.refusals.push_back({id.chain.session, id.index, content_hash("garbage")});
  EXPECT_TRUE(done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_))
                  .events.empty());
  EXPECT_TRUE(node_->backlog().contains(id));
  const auto mine = std::ranges::find(sent_, message_id(id), &bus::Envelope::id);
  ASSERT_NE(mine, sent_.end());
  receipt.refusals.push_back({id.chain.session, id.index, content_hash(*mine->bytes)});
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  EXPECT_FALSE(node_->backlog().contains(id));
}

TEST_F(RobotNodeTest, WhatAServerHasForgottenGoesAgainAlsoWhenItRefusesGarbageUnderItsId) {
  walk(0, 100);
  const SubmapId id = node_->backlog().begin()->first;
  Receipt receipt{.robot = kRobot, .incarnation = 1};
  receipt.stored[id.chain.session].insert(id.index);
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  EXPECT_FALSE(node_->backlog().contains(id));
  receipt = {.robot = kRobot, .incarnation = 2, .why_refused = "no good"};
  receipt.refuse(id, content_hash("garbage"), 9);
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  EXPECT_TRUE(node_->backlog().contains(id));
}

TEST_F(RobotNodeTest, AForgedReceiptDeletesNothingAndTheNextOfTheServerUndoesIt) {
  walk(0, 100);
  std::vector<SubmapId> all;
  for (const auto& [id, size] : node_->backlog()) all.push_back(id);
  const std::vector<bus::Envelope> before = std::exchange(sent_, {});
  confirm(all);  // which the server does not have
  EXPECT_TRUE(node_->backlog().empty());
  EXPECT_EQ(rows("outbox"), all.size());
  restart();
  EXPECT_TRUE(sent_.empty());
  confirm({all[0], all[2]});
  EXPECT_EQ(node_->backlog().size(), all.size() - 2);
  EXPECT_EQ(rows("archive"), 2U);
  ASSERT_EQ(sent_.size(), all.size() - 2);
  EXPECT_EQ(*sent_.back().bytes, *before[1].bytes);
}

TEST_F(RobotNodeTest, WhatAServerRefusedLongAgoIsNotSentAgainAndAgain) {
  walk(0, 100);
  const SubmapId bad = node_->backlog().begin()->first;
  Receipt receipt{.robot = kRobot, .incarnation = 1, .why_refused = "no good"};
  receipt.refuse(bad, content_hash(store_->tables().at("outbox").at(key_of(bad))), 1);
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  ASSERT_TRUE(node_->archive().contains(bad));
  restart();
  receipt.forget_refusals(bad);  // its list is bounded
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  EXPECT_TRUE(node_->archive().contains(bad));
  receipt.incarnation = 2;  // another server may take it
  done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_));
  EXPECT_TRUE(node_->backlog().contains(bad));
}

TEST_F(RobotNodeTest, SaysHowItIs) {
  config_.name = "alpha";
  restart();
  EXPECT_EQ(node_->status(now_).name, "alpha");
  EXPECT_EQ(node_->status(now_).session, 101U);  // the store's
  EXPECT_EQ(node_->status(now_).start, 2U);
  EXPECT_EQ(node_->status(now_).update_age_s, std::nullopt);
  walk(0, 130);
  now_ = now_ + 5.0;
  hear(3);
  now_ = now_ + 2.0;
  const NodeStatus status = node_->status(now_);
  EXPECT_TRUE(wire::validate(status).has_value());
  EXPECT_EQ(status.heard_revision, 3U);
  EXPECT_EQ(status.update_age_s, 2.0);
  EXPECT_EQ(status.keyframes, 130U);
  EXPECT_LT(local(status.T_odom_body, odometry_[129].pose).norm(), 1e-12);
  EXPECT_FALSE(status.finished);
  done(node_->finish(now_));
  EXPECT_TRUE(node_->status(now_).finished);
  walk(130, 131);  // not quite
  EXPECT_FALSE(node_->status(now_).finished);
}

TEST_F(RobotNodeTest, KnowsWhenItsNameIsSomebodyElses) {
  const auto reported = [&](std::uint64_t session, std::uint64_t start, const std::string& why) {
    Receipt receipt{.robot = kRobot, .owner_session = 7, .conflict = Receipt::Conflict{session, start, why}};
    return done(node_->receive(test::from_server(kRobot, MessageKind::receipt, wire::encode(receipt)), now_))
        .events.size();
  };
  EXPECT_EQ(node_->owner_session(), std::nullopt);
  EXPECT_EQ(reported(101, 7, "of another start"), 0U);
  EXPECT_EQ(node_->owner_session(), 7U);
  EXPECT_EQ(reported(55, 1, "of another session"), 0U);
  EXPECT_EQ(node_->conflict(), std::nullopt);
  EXPECT_EQ(reported(101, 1, "alpha is there"), 1U);
  EXPECT_EQ(node_->conflict(), "alpha is there");
  EXPECT_EQ(reported(101, 1, "alpha is there"), 0U);
  walk(0, 100);
  EXPECT_FALSE(sent_.empty());  // it goes on
  confirm({});
  EXPECT_EQ(node_->conflict(), std::nullopt);
  EXPECT_EQ(reported(101, 1, "alpha is there"), 1U);
  restart();
  EXPECT_EQ(reported(101, 1, "alpha is there"), 0U);  // what was sent before it started again
}

TEST_F(RobotNodeTest, AKillLosesNoMoreThanThePeriodAndWhatIsFedAgainMakesTheSame) {
  config_.journal_period_s = 3.5;  // seven samples
  store_.reset();
  restart();
  walk(0, 130);
  hear(1);  // at once
  walk(130, 158);
  const auto whole = wire::encode(node_->agent().state());
  restart();
  const Timestamp newest = node_->agent().newest_sample().value();
  EXPECT_LT(newest, odometry_[157].stamp);
  EXPECT_LE(odometry_[157].stamp - newest, config_.journal_period_s);
  int again = 0;
  while (odometry_[again].stamp < newest) ++again;
  walk(again, 158);  // its own scan too
  EXPECT_EQ(wire::encode(node_->agent().state()), whole);
}

TEST_F(RobotNodeTest, APlannedEndLosesNothing) {
  walk(0, 128);
  const auto whole = wire::encode(node_->agent().state());
  done(node_->store_all());
  restart();
  EXPECT_EQ(wire::encode(node_->agent().state()), whole);
}

TEST_F(RobotNodeTest, TheDiskIsAskedOnceAPeriodAndWhenSomethingIsSent) {
  config_.journal_period_s = 0.0;
  restart();
  transactions_ = 0;
  walk(0, 150);
  const std::size_t before = std::exchange(transactions_, 0);
  config_.journal_period_s = 10.0;
  store_.reset();
  now_ = {};
  sent_.clear();
  restart();
  transactions_ = 0;
  walk(0, 150);             // 75 s
  EXPECT_GE(before, 250U);  // samples and scans
  EXPECT_LE(transactions_, 8U + sent_.size());
  EXPECT_TRUE(node_->next_timer().has_value());
}

TEST_F(RobotNodeTest, TheNewestGoesFirstAndAgainAfterAMinute) {
  config_.uplink.max_under_way_bytes = 1;
  store_.reset();
  restart();
  walk(0, 100);
  ASSERT_EQ(sent_.size(), 1U);
  EXPECT_EQ(sent_[0].id, "1/102/0");
  const SubmapId newest = node_->backlog().rbegin()->first;
  ASSERT_GE(newest.index, 2U);
  confirm({{newest.chain, 0}});
  ASSERT_EQ(sent_.size(), 2U);
  EXPECT_EQ(sent_[1].id, message_id(newest));
  EXPECT_EQ(*sent_[1].bytes, *store_->read("outbox", key_of(newest)).value());
  now_ = now_ + 59.0;
  done(node_->on_timer(now_));
  EXPECT_EQ(sent_.size(), 2U);
  now_ = now_ + 1.0;
  ASSERT_LE(node_->next_timer().value(), now_);
  done(node_->on_timer(now_));
  ASSERT_EQ(sent_.size(), 3U);
  EXPECT_EQ(sent_[2].id, sent_[1].id);
}

TEST_F(RobotNodeTest, RefusesWhatIsNotForIt) {
  walk(0, 50);
  const auto before = store_->tables();
  for (const Step& step : {confirm({{{RobotId{2}, 101}, 0}}, RobotId{2}),
                           done(node_->receive(test::from_server(kRobot, MessageKind::receipt, "garbage"), now_)),
                           done(node_->receive(test::from_server(kRobot, MessageKind::proxy_graph, "garbage"), now_)),
                           done(node_->receive(test::from_server(kRobot, MessageKind::job, "garbage"), now_)),
                           done(node_->add(OdometrySample{odometry_[3].stamp, {}, {}}, now_)),
                           done(node_->add(Scan{odometry_[3].stamp, std::make_shared<PointCloud>(), {}}, now_))})
    EXPECT_EQ(step.events.size(), 1U);
  EXPECT_EQ(store_->tables(), before);
}

TEST_F(RobotNodeTest, AScanThatComesAgainCountsOnce) {
  walk(0, 51);
  ASSERT_EQ(node_->agent().state().submaps.heard_scan, odometry_[50].stamp);
  const std::size_t scans = node_->agent().state().submaps.scans.size();
  PointCloud cloud;
  cloud.points.emplace_back(1.0F, 5.0F, 1.0F);
  const Scan again{odometry_[50].stamp, std::make_shared<const PointCloud>(cloud), {}};
  EXPECT_TRUE(done(node_->add(again, now_)).writes.empty());
  now_ = now_ + config_.journal_period_s;
  done(node_->on_timer(now_));
  restart();
  EXPECT_TRUE(done(node_->add(again, now_)).writes.empty());
  EXPECT_EQ(node_->agent().state().submaps.scans.size(), scans);
}

// 200 samples a second, scans between them: what is killed and fed again makes the same, to the bit.
TEST_F(RobotNodeTest, AKillBetweenSamplesAndScansThatNeverMeetLosesNothing) {
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
  const auto pose = [&](double t) { return Pose3{Eigen::Quaterniond::Identity(), {0.9 * t, 0.0, 0.0}}; };
  const Timestamp start = odometry_[0].stamp;
  const auto scan_stamp = [&](int k) { return start + (0.0377 + 0.1 * k); };
  int next_scan = 0;
  const auto live = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      now_ = Timestamp{} + 0.005 * i;
      done(node_->add(OdometrySample{start + 0.005 * i, pose(0.005 * i), 1e-7 * Matrix6d::Identity()}, now_));
      for (; scan_stamp(next_scan) < start + (0.005 * i - 0.03); ++next_scan)
        done(node_->add(Scan{scan_stamp(next_scan), cloud, {}}, now_));
    }
  };
  live(0, 6000);
  const std::string whole = wire::encode(node_->agent().state());
  EXPECT_GE(sent_.size(), 2U);
  EXPECT_LE(node_->agent().keyframes_without_scan().value(), 1U);
  EXPECT_GE(node_->agent().keyframes().size(), 60U);
  const auto frames = [&] {
    std::map<std::string, std::string> out;  // what waits for a receipt is sent again
    for (const bus::Envelope& message : std::exchange(sent_, {})) out[message.id] = *message.bytes;
    return out;
  };
  const auto sent = frames();

  store_.reset();
  starts_ = 0;
  restart();
  next_scan = 0;
  live(0, 4567);
  restart();  // without what waited to be written
  const Timestamp newest = node_->agent().newest_sample().value(), settled = node_->agent().settled().value();
  ASSERT_LT(newest, start + 0.005 * 4566);
  const int again = static_cast<int>(std::lround((newest - start) / 0.005)) + 1;
  for (next_scan = 0; scan_stamp(next_scan) < settled;) ++next_scan;
  live(again, 6000);
  EXPECT_EQ(wire::encode(node_->agent().state()), whole);
  EXPECT_EQ(frames(), sent);
}

TEST_F(RobotNodeTest, KeyframesWithoutAScanAreReported) {
  const auto reported = [&](int from, int to, bool with_scans) {
    std::vector<SensorMissing> out;
    const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
    for (int i = from; i < to; ++i) {
      const Timestamp stamp = odometry_[0].stamp + 0.05 * i;
      const auto note = [&](const Step& step) {
        for (const Event& event : step.events)
          if (const auto* missing = std::get_if<SensorMissing>(&event.what)) out.push_back(*missing);
      };
      note(done(node_->add(
          OdometrySample{stamp, {Eigen::Quaterniond::Identity(), {0.05 * i, 0.0, 0.0}}, 1e-7 * Matrix6d::Identity()},
          now_)));
      if (with_scans) note(done(node_->add(Scan{stamp, cloud, {}}, now_)));
    }
    return out;
  };
  EXPECT_TRUE(reported(0, 400, false).empty());  // it has no such sensor, as far as anybody knows
  EXPECT_TRUE(reported(400, 600, true).empty());
  auto missing = reported(600, 1000, false);
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].sensor, "scan");
  EXPECT_EQ(missing[0].keyframes, config_.most_keyframes_without);
  missing = reported(1000, 1100, true);
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].keyframes, 0U);
}

TEST_F(RobotNodeTest, WithoutAStoreToWriteToItWritesNothing) {
  config_.keeps_state = false;
  store_.reset();
  restart();
  walk(0, 100);
  hear(1);
  for (const auto& [table, written] : store_->tables()) EXPECT_TRUE(written.empty()) << table;
  EXPECT_GE(sent_.size(), 4U);
  EXPECT_TRUE(node_->backlog().empty());
}

TEST_F(RobotNodeTest, AnotherRobotsStoreOrADamagedOneIsRefused) {
  walk(0, 50);
  EXPECT_FALSE(RobotNode::open(RobotId{2}, 1, config_, *store_).has_value());
  auto tables = store_->tables();
  tables.at("meta").at("robot").pop_back();
  const storage::MemoryStore damaged(storage::robot_schema(), tables);
  EXPECT_FALSE(RobotNode::open(kRobot, 1, config_, damaged).has_value());
}

/// On a bus without rights anybody may send a graph in the server's name.
TEST_F(RobotNodeTest, AForgedRevisionIsNotTheLastThatIsBelieved) {
  walk(0, 130);
  hear(5);
  hear(20'931);
  EXPECT_EQ(node_->agent().state().revision, 20'931U);
  for (const std::uint64_t late : {5U, 5U, 4U}) {  // what comes again, or late, proves nothing
    EXPECT_TRUE(hear(late).events.empty());
  }
  EXPECT_TRUE(hear(6).events.empty());
  const Step step = hear(7);
  ASSERT_EQ(step.events.size(), 2U);
  const auto* reported = std::get_if<MessageRefused>(&step.events[0].what);
  ASSERT_NE(reported, nullptr);
  EXPECT_NE(reported->why.find("20931"), std::string::npos) << reported->why;
  EXPECT_EQ(node_->agent().state().revision, 7U);
  EXPECT_EQ(hear(8).events.size(), 1U);
  restart();
  EXPECT_EQ(node_->agent().state().revision, 8U);
}

TEST_F(RobotNodeTest, ADeltaIsHeardAsSoonAsItsBaseIsThere) {
  walk(0, 130);
  const std::string first = wire::encode(graph(1));
  const ProxyGraph base = wire::decode_proxy_graph(first)->graph;
  const auto delta = test::from_server(kRobot, MessageKind::proxy_graph_delta, wire::encode_delta(graph(2), base));
  EXPECT_TRUE(done(node_->receive(delta, now_)).events.empty());  // it waits
  EXPECT_EQ(node_->newest_graph(), nullptr);
  const Step step = done(node_->receive(test::from_server(kRobot, MessageKind::proxy_graph, first), now_));
  ASSERT_EQ(step.events.size(), 1U);  // for both
  EXPECT_EQ(std::get<RobotUpdated>(step.events[0].what).summary.revision, 2U);
  EXPECT_EQ(node_->newest_graph()->graph.revision, 2U);
  const std::string heard = wire::encode(node_->agent().state());

  restart();  // the journal does without the base
  EXPECT_EQ(wire::encode(node_->agent().state()), heard);
  EXPECT_TRUE(done(node_->receive(delta, now_)).events.empty());
  EXPECT_TRUE(
      done(node_->receive(test::from_server(kRobot, MessageKind::proxy_graph, first), now_)).events.empty());  // old
  const auto newer = test::from_server(kRobot, MessageKind::proxy_graph_delta, wire::encode_delta(graph(3), base));
  EXPECT_EQ(done(node_->receive(newer, now_)).events.size(), 1U);
  const auto of_another =
      test::from_server(kRobot, MessageKind::proxy_graph_delta, wire::encode_delta(graph(4), graph(3).graph));
  EXPECT_TRUE(done(node_->receive(of_another, now_)).events.empty());
  EXPECT_EQ(node_->newest_graph()->graph.revision, 3U);
  hear(5);  // in full; the waiting delta is of no use any more
  EXPECT_EQ(node_->agent().state().revision, 5U);
  const Step garbage = done(node_->receive(test::from_server(kRobot, MessageKind::proxy_graph_delta, "garbage"), now_));
  ASSERT_EQ(garbage.events.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<MessageRefused>(garbage.events[0].what));
  EXPECT_EQ(node_->newest_graph()->graph.revision, 5U);
}

}  // namespace robot_node_test
}  // namespace tutti::node
