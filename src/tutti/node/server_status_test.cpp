// SPDX-License-Identifier: BSD-3-Clause
// ServerNode keeps track of robots and workers, and sends them and viewers its status.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "support/node/submaps.hpp"
#include "tutti/base/content_hash.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace server_status_test {

using bus::Endpoint, bus::MessageKind;
constexpr RobotId kAlpha{0}, kStranger{77};

class ServerStatus : public testing::Test {
 protected:
  ServerStatus() { restart(); }
  void restart() {
    store_ = std::make_unique<storage::MemoryStore>(storage::map_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = ServerNode::open({kAlpha}, std::make_shared<test::EvenVerifier>(), {.accepts_others = accepts_others_},
                             1000, *store_)
                .value();
    done(node_->resume(now_));
  }
  Step done(Step step) {
    EXPECT_TRUE(store_->commit(step.writes).has_value());
    for (const bus::Envelope& message : step.messages) {
      if (message.kind == MessageKind::receipt) receipts_[message.to] = wire::decode_receipt(*message.bytes).value();
      if (message.kind == MessageKind::proxy_graph)
        bases_[message.to] = wire::decode_proxy_graph(*message.bytes).value().graph;
    }
    return step;
  }
  Step receive(const bus::Envelope& envelope) { return done(node_->receive(envelope, now_)); }
  Step hear(RobotId robot, const std::string& name, std::uint64_t session) {
    return receive(to_server(Endpoint::of(robot), {.name = name, .session = session, .start = 2}));
  }
  /// The submap's number in what the robot is sent.
  Step send(const SubmapMessage& message, const std::string& id) {
    bus::Envelope envelope = test::envelope(message);
    envelope.id = id;
    return receive(envelope);
  }
  /// The session whose proxy nodes the robot was sent; nothing: it was sent none.
  std::optional<std::uint64_t> graph_of(RobotId robot) {
    now_ = now_ + 30.0;
    const Step step = done(node_->on_timer(now_));
    for (const bus::Envelope& message : step.messages) {
      if (message.to != Endpoint::of(robot)) continue;
      const ProxyGraph& base = bases_[message.to];
      const ProxyGraph graph = message.kind == MessageKind::proxy_graph
                                   ? base
                                   : wire::decode_delta(*message.bytes, base).value().value().graph;
      if (!graph.nodes.empty()) return graph.nodes.front().chain.session;
    }
    return std::nullopt;
  }
  template <class What>
  static std::size_t reported(const Step& step) {
    return static_cast<std::size_t>(
        std::ranges::count_if(step.events, [](const Event& e) { return std::holds_alternative<What>(e.what); }));
  }
  [[nodiscard]] const Receipt& receipt(RobotId robot) const { return receipts_.at(Endpoint::of(robot)); }

  bool accepts_others_ = true;
  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<ServerNode> node_;
  std::map<Endpoint, Receipt> receipts_;
  std::map<Endpoint, ProxyGraph> bases_;  // the last that came in full
  Timestamp now_ = Timestamp{} + 3.0;
};

TEST_F(ServerStatus, ARobotWhoseSubmapsWaitIsSentAgainWhatIsStored) {
  const auto receipts = [&](std::uint64_t backlog) {
    const Step step = receive(
        to_server(Endpoint::of(kAlpha), {.name = "alpha", .session = 7, .start = 2, .backlog_submaps = backlog}));
    return std::ranges::count(step.messages, MessageKind::receipt, &bus::Envelope::kind);
  };
  EXPECT_EQ(receipts(1), 1);  // it is the owner
  receive(test::envelope(test::submap({kAlpha, 7}, 0)));
  receipts_.clear();  // with the bus
  for (now_ = now_ + 58.0; now_ - Timestamp{} < 62.0; now_ = now_ + 2.0) EXPECT_EQ(receipts(1), 0);
  now_ = now_ + 2.0;
  EXPECT_EQ(receipts(1), 1);
  EXPECT_TRUE(receipt(kAlpha).contains({{kAlpha, 7}, 0}));
  now_ = now_ + 59.0;
  EXPECT_EQ(receipts(1), 0);
  now_ = now_ + 2.0;
  EXPECT_EQ(receipts(1), 1);
  EXPECT_EQ(receipts(0), 0);
  now_ = now_ + 100.0;
  EXPECT_EQ(receipts(1), 0);
}

TEST_F(ServerStatus, FoldsWhatItKnowsOfEverybody) {
  NodeStatus status{.name = "alpha", .session = 7, .backlog_submaps = 4, .update_age_s = 1.0, .finished = true};
  receive(to_server(Endpoint::of(kAlpha), status));
  receive(to_server(Endpoint::worker(5), {.name = "worker_5", .jobs_done = 9}));
  receive(test::envelope(test::submap({kAlpha, 7}, 0)));
  receive(test::envelope(test::submap({kAlpha, 7}, 1)));
  bus::Envelope garbage = to_server(Endpoint::of(kStranger), {.name = "x"});
  garbage.bytes = std::make_shared<const std::string>("TU\n");
  receive(garbage);
  receive(garbage);
  const std::uint64_t changes = node_->changes();
  now_ = now_ + 20.0;
  done(node_->on_timer(now_));
  EXPECT_GT(node_->changes(), changes);
  const MissionStatus mission = node_->mission_status(now_);
  EXPECT_TRUE(wire::validate(mission).has_value());
  EXPECT_EQ(mission.time, now_);
  EXPECT_EQ(mission.epoch, 1000U);
  EXPECT_EQ(mission.revision, 1U);
  EXPECT_EQ(mission.submaps, 2U);
  EXPECT_EQ(mission.components, 1U);
  EXPECT_EQ(mission.pending_jobs, 1U);
  EXPECT_FALSE(mission.has_news);
  ASSERT_EQ(mission.robots.size(), 1U);
  EXPECT_EQ(mission.robots[0].status, status);
  EXPECT_EQ(mission.robots[0].submaps, 2U);
  EXPECT_EQ(mission.robots[0].last_seen, now_ - 20.0);
  EXPECT_EQ(mission.robots[0].last_update, now_ - 21.0);
  ASSERT_EQ(mission.workers.size(), 1U);
  EXPECT_EQ(mission.workers[0].status.jobs_done, 9U);
  ASSERT_EQ(mission.refusals.size(), 1U);
  EXPECT_EQ(mission.refusals[0].from, "robot");
  EXPECT_EQ(mission.refusals[0].kind, "status");
  EXPECT_EQ(mission.refusals[0].count, 2U);
  EXPECT_EQ(wire::decode_mission_status(*to_viewers(mission).bytes).value(), mission);
}

TEST_F(ServerStatus, WorkersThatAreSilentAreForgottenRobotsAreNot) {
  receive(to_server(Endpoint::worker(5), {.name = "worker_5"}));
  hear(kAlpha, "alpha", 7);
  now_ = now_ + 400.0;
  receive(to_server(Endpoint::worker(6), {.name = "worker_6"}));
  const MissionStatus mission = node_->mission_status(now_);
  ASSERT_EQ(mission.workers.size(), 1U);
  EXPECT_EQ(mission.workers[0].number, 6U);
  EXPECT_EQ(mission.robots[0].last_seen, now_ - 400.0);
}

TEST_F(ServerStatus, ASecondRobotOfTheNameLearnsWhoIsThere) {
  EXPECT_EQ(reported<RobotJoined>(hear(kAlpha, "alpha", 7)), 1U);
  EXPECT_EQ(receipt(kAlpha).owner_session, 7U);
  EXPECT_TRUE(hear(kAlpha, "alpha", 7).messages.empty());  // no news
  EXPECT_EQ(reported<RobotRefused>(hear(kAlpha, "alpha", 8)), 1U);
  EXPECT_EQ(receipt(kAlpha).owner_session, 7U);
  ASSERT_TRUE(receipt(kAlpha).conflict.has_value());
  EXPECT_EQ(receipt(kAlpha).conflict->session, 8U);
  EXPECT_EQ(receipt(kAlpha).conflict->start, 2U);
  EXPECT_NE(receipt(kAlpha).conflict->why.find("session 7"), std::string::npos);
  const Step again = hear(kAlpha, "alpha", 8);
  EXPECT_TRUE(again.messages.empty() && again.events.empty() && again.writes.empty());
  EXPECT_EQ(node_->mission_status(now_).robots[0].status.session, 7U);
  EXPECT_FALSE(node_->mission_status(now_).robots[0].conflict.empty());
  EXPECT_EQ(node_->mission_status(now_).refusals.at(0).count, 2U);
  EXPECT_EQ(reported<RobotRefused>(hear(kStranger, "alpha", 9)), 1U);  // by its name
  EXPECT_EQ(receipt(kStranger).conflict->session, 9U);
  now_ = now_ + 31.0;
  EXPECT_EQ(reported<RobotJoined>(hear(kAlpha, "alpha", 8)), 1U);
  EXPECT_EQ(receipt(kAlpha).owner_session, 8U);
  EXPECT_FALSE(receipt(kAlpha).conflict.has_value());
}

TEST_F(ServerStatus, NoOtherSessionTakesTheGraphOfTheNewestWhateverItsNumber) {
  const auto fill = [&](std::uint64_t session) {
    for (std::uint32_t i = 0; i < 2; ++i) receive(test::envelope(test::submap({kAlpha, session}, i)));
  };
  hear(kAlpha, "alpha", 50);
  fill(50);
  EXPECT_EQ(graph_of(kAlpha), 50U);
  hear(kAlpha, "alpha", 50);
  fill(99);
  EXPECT_EQ(graph_of(kAlpha), 50U);  // submaps alone do not count
  hear(kAlpha, "alpha", 50);
  hear(kAlpha, "alpha", 99);
  fill(10);
  EXPECT_EQ(graph_of(kAlpha), 50U);
  restart();
  hear(kAlpha, "alpha", 99);  // refused before the restart
  receive(test::envelope(test::submap({kAlpha, 50}, 5)));
  EXPECT_EQ(graph_of(kAlpha), 50U);
  now_ = now_ + 60.0;
  hear(kAlpha, "alpha", 10);  // a new start whose clock is behind: the others are gone
  receive(test::envelope(test::submap({kAlpha, 50}, 7)));
  EXPECT_EQ(graph_of(kAlpha), 10U);
  now_ = now_ + 60.0;
  hear(kAlpha, "alpha", 50);
  receive(test::envelope(test::submap({kAlpha, 50}, 8)));
  EXPECT_EQ(graph_of(kAlpha), 10U);
}

TEST_F(ServerStatus, RobotsThatItDoesNotKnowAreTakenIfItIsOpen) {
  hear(kStranger, "stranger", 7);
  receive(test::envelope(test::submap({kStranger, 7}, 0)));
  receive(test::envelope(test::submap({kStranger, 7}, 1)));
  receive(test::envelope(test::submap({RobotId{78}, 3}, 0)));  // before it has sent who it is
  EXPECT_TRUE(receipt(kStranger).contains({{kStranger, 7}, 0}));
  EXPECT_EQ(graph_of(kStranger), 7U);
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 3U);
  EXPECT_EQ(node_->mission_status(now_).robots[2].status.name, "robot_78");
  restart();
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 3U);
  EXPECT_EQ(node_->mission_status(now_).robots[1].status.name, "stranger");
  EXPECT_EQ(node_->mission_status(now_).robots[1].last_seen, std::nullopt);
  receive(test::envelope(test::submap({kStranger, 7}, 2)));
  EXPECT_EQ(graph_of(kStranger), 7U);
}

TEST_F(ServerStatus, AndRefusedIfItIsNot) {
  accepts_others_ = false;
  restart();
  EXPECT_EQ(reported<MessageRefused>(hear(kStranger, "stranger", 7)), 1U);
  EXPECT_EQ(reported<MessageRefused>(receive(test::envelope(test::submap({kStranger, 7}, 0)))), 1U);
  ASSERT_TRUE(receipt(kStranger).conflict.has_value());
  EXPECT_NE(receipt(kStranger).conflict->why.find("none of the mission's"), std::string::npos);
  EXPECT_TRUE(hear(kStranger, "stranger", 7).messages.empty());  // it has been sent
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 1U);
  EXPECT_EQ(node_->mission_status(now_).refusals.size(), 2U);
  for (std::uint32_t i = 0; i < 1200; ++i) hear(RobotId{1000 + i}, "fake", 7);
  EXPECT_EQ(receipts_.size(), 1000U);  // the bus keeps each
  now_ = now_ + 61.0;
  hear(RobotId{90}, "late", 7);
  EXPECT_TRUE(receipt(RobotId{90}).conflict.has_value());  // the others send nothing more
}

TEST_F(ServerStatus, WhatItNeverTakesIsInTheReceiptAndSurvivesARestart) {
  const ChainId chain{kAlpha, 7};
  receive(test::envelope(test::submap(chain, 0)));
  bus::Envelope garbage = test::envelope(test::submap(chain, 1));
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  SubmapMessage torn = test::submap(chain, 2);
  torn.submap.odometry[0].T_a_b.translation.x() += 5.0;
  for (const bus::Envelope& bad : {garbage, test::envelope(torn)})
    EXPECT_EQ(reported<MessageRefused>(receive(bad)), 1U);
  EXPECT_EQ(reported<MessageRefused>(send(test::submap(chain, 3), "0/7/4")), 1U);  // not what it is called
  const auto check = [&] {
    for (std::uint32_t i = 0; i < 6; ++i) {
      EXPECT_EQ(receipt(kAlpha).contains({chain, i}), i == 0) << i;
      EXPECT_EQ(receipt(kAlpha).refuses({chain, i}), i == 1 || i == 2 || i == 4) << i;
    }
    EXPECT_NE(receipt(kAlpha).why_refused.find("0/7/4"), std::string::npos) << receipt(kAlpha).why_refused;
  };
  check();
  EXPECT_EQ(store_->tables().at("submaps").size(), 1U);
  EXPECT_EQ(node_->mission_status(now_).robots[0].refused, 0U);  // they may be anybody's
  receive(to_server(Endpoint::of(kAlpha), {.name = "alpha", .session = 7, .start = 1, .submaps = 5}));
  EXPECT_EQ(node_->mission_status(now_).robots[0].refused, 3U);
  receipts_.clear();
  restart();
  check();
}

/// A submap refused under a number that the robot has not used is not the robot's, and is not reported as that. It was
/// reported for ever.
TEST_F(ServerStatus, GarbageUnderNumbersThatARobotNeverUsedIsNotTheRobots) {
  const ChainId chain{kAlpha, 7};
  receive(test::envelope(test::submap(chain, 0)));
  bus::Envelope garbage = test::envelope(test::submap(chain, 1));
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  for (const SubmapId id : {SubmapId{chain, 1}, {chain, 5}, {chain, 6}, {{kAlpha, 8}, 0}}) {
    garbage.id = message_id(id);
    receive(garbage);
  }
  const auto refused = [&](std::uint64_t submaps) {
    receive(to_server(Endpoint::of(kAlpha), {.name = "alpha", .session = 7, .start = 2, .submaps = submaps}));
    return node_->mission_status(now_).robots.at(0).refused;
  };
  EXPECT_EQ(refused(1), 0U);
  EXPECT_EQ(refused(3), 1U);
  receive(test::envelope(test::submap(chain, 2)));
  EXPECT_EQ(refused(3), 1U);  // one was really lost
  receive(test::envelope(test::submap(chain, 1)));
  EXPECT_EQ(refused(3), 0U);
  EXPECT_EQ(node_->mission_status(now_).refusals.at(0).count, 4U);
}

TEST_F(ServerStatus, OfOneIdTheFirstContentStays) {
  const ChainId chain{kAlpha, 7};
  const SubmapMessage first = test::submap(chain, 0);
  SubmapMessage other = first;
  other.submap.cloud = std::make_shared<const PointCloud>(PointCloud{{{9.0F, 9.0F, 1.0F}}});
  receive(test::envelope(first));
  const auto submaps = store_->tables().at("submaps");
  const Step step = receive(test::envelope(other));
  EXPECT_EQ(reported<MessageRefused>(step), 1U);
  EXPECT_EQ(store_->tables().at("submaps"), submaps);
  restart();
  EXPECT_TRUE(receipt(kAlpha).refuses({chain, 0}, content_hash(*test::envelope(other).bytes)));  // so its robot knows
  EXPECT_FALSE(receipt(kAlpha).refuses({chain, 0}, content_hash(*test::envelope(first).bytes)));
  EXPECT_TRUE(receipt(kAlpha).contains({chain, 0}));  // it need not come once more
  EXPECT_FALSE(receipt(kAlpha).refuses({chain, 0}));
  EXPECT_EQ(reported<MessageRefused>(receive(test::envelope(first))), 0U);
}

TEST_F(ServerStatus, NobodysGarbageFillsTheReceipt) {
  bus::Envelope garbage = test::envelope(test::submap({kAlpha, 7}, 0));
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  for (std::uint64_t session = 0; session < 300; ++session) {
    garbage.id = message_id({{kAlpha, session}, 0});
    receive(garbage);
  }
  for (std::uint32_t i = 0; i < 3000; i += 2) {
    garbage.id = message_id({{kAlpha, 3}, i});
    receive(garbage);
  }
  EXPECT_EQ(receipt(kAlpha).refusals.size(), 256U);
  EXPECT_EQ(receipt(kAlpha).refused.at(3).intervals().size(), 256U);
  EXPECT_EQ(node_->mission_status(now_).refusals.at(0).count, 1800U);
}

TEST_F(ServerStatus, WhoSendsGarbageUnderARobotsNextIdDoesNotRefuseItsSubmap) {
  const SubmapMessage next = test::submap({kAlpha, 7}, 3);
  bus::Envelope garbage = test::envelope(next);
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  receive(garbage);
  const std::uint64_t content = content_hash(*test::envelope(next).bytes);
  EXPECT_TRUE(receipt(kAlpha).refuses(next.submap.id, content_hash(*garbage.bytes)));
  EXPECT_FALSE(receipt(kAlpha).refuses(next.submap.id, content));
  restart();
  receive(garbage);
  EXPECT_FALSE(receipt(kAlpha).refuses(next.submap.id, content));
  EXPECT_EQ(reported<SubmapStored>(receive(test::envelope(next))), 1U);
  for (int start = 0; start < 2; ++start) {
    EXPECT_TRUE(receipt(kAlpha).contains(next.submap.id));
    EXPECT_FALSE(receipt(kAlpha).refuses(next.submap.id));  // nothing of it is lacking
    EXPECT_EQ(node_->mission_status(now_).robots[0].refused, 0U);
    restart();
  }
}

/// As of a robot that was upgraded before its server.
TEST_F(ServerStatus, ARobotThatNobodyKnowsLearnsOfAnUnreadOrRefusedSubmapAndIsNoneOfTheMissionsForIt) {
  const auto before = store_->tables();
  bus::Envelope newer = test::envelope(test::submap({kStranger, 7}, 0));
  std::string frame = *newer.bytes;
  ++frame[2];  // its version
  newer.bytes = std::make_shared<const std::string>(frame);
  EXPECT_EQ(reported<MessageRefused>(receive(newer)), 1U);
  bus::Envelope garbage = test::envelope(test::submap({kStranger, 7}, 1));
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  receive(garbage);
  EXPECT_TRUE(receipt(kStranger).leaves_unread({{kStranger, 7}, 0}));
  EXPECT_TRUE(receipt(kStranger).refuses({{kStranger, 7}, 1}, content_hash(*garbage.bytes)));
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 1U);
  EXPECT_EQ(store_->tables(), before);
  hear(kStranger, "stranger", 7);
  EXPECT_EQ(node_->mission_status(now_).robots.at(1).unread, 1U);
  receive(test::envelope(test::submap({kStranger, 7}, 2)));
  EXPECT_TRUE(receipt(kStranger).leaves_unread({{kStranger, 7}, 0}));
  EXPECT_TRUE(receipt(kStranger).contains({{kStranger, 7}, 2}));
}

/// More statuses of robots that nobody knows than a map has room for, and first submaps that are none.
TEST_F(ServerStatus, StrangersLockNobodyOut) {
  const auto before = store_->tables();
  for (std::uint32_t i = 0; i < 1200; ++i) {
    hear(RobotId{1000 + i}, "fake_" + std::to_string(i), 7);
    SubmapMessage torn = test::submap({RobotId{5000 + i}, 7}, 2);
    torn.submap.odometry[0].T_a_b.translation.x() += 5.0;
    receive(test::envelope(torn));
  }
  EXPECT_EQ(store_->tables(), before);
  now_ = now_ + 1.0;
  hear(kStranger, "real", 7);
  EXPECT_LE(node_->mission_status(now_).robots.size(), 100U);
  EXPECT_TRUE(std::ranges::any_of(node_->mission_status(now_).robots,
                                  [](const auto& robot) { return robot.status.name == "real"; }));
  EXPECT_EQ(reported<SubmapStored>(receive(test::envelope(test::submap({kStranger, 7}, 0)))), 1U);
  EXPECT_TRUE(receipt(kStranger).contains({{kStranger, 7}, 0}));
  now_ = now_ + 100.0;
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 2U);  // the others are forgotten
  hear(RobotId{90}, "later", 7);
  EXPECT_EQ(receipt(RobotId{90}).owner_session, 7U);
  restart();
  EXPECT_EQ(node_->mission_status(now_).robots.size(), 2U);
  EXPECT_EQ(node_->mission_status(now_).robots[1].status.name, "real");
}

/// A robot's returns about the map that it localises in, if that is this server's.
class ServerStatusPlaces : public ServerStatus {
 protected:
  ServerStatusPlaces() {
    send(test::submap(kAlpha, 0), "0/0/0");
    map_ = localise::map_id_of(*test::envelope(test::submap(kAlpha, 0)).bytes);
  }
  Step hear_returns(RobotId robot, std::vector<SubmapReturn> fits) {
    NodeStatus status{.name = "r" + std::to_string(robot.value), .start = 2};
    status.in_map = {.map = map_, .version = 1, .state = "localised"};
    status.in_map.fits = std::move(fits);
    return receive(to_server(Endpoint::of(robot), status));
  }
  std::string map_;
};

TEST_F(ServerStatusPlaces, WhatRobotsReturnIsKeptAndAfterARestartToo) {
  hear_returns(kAlpha, {{{kAlpha, 0}, 0, 1, 7, 30}});
  const MissionStatus status = node_->mission_status(now_);
  EXPECT_EQ(status.places_map, map_);
  ASSERT_EQ(status.places.size(), 1U);
  EXPECT_EQ(status.places[0], (MissionStatus::Place{"0/0", "r0/0", 0, 1, 7, 0.0, 30, {kAlpha}}));
  EXPECT_TRUE(status.robots.front().status.in_map.fits.empty()) << "they would be sent twice";
  restart();
  EXPECT_EQ(node_->mission_status(now_).places, status.places);
}

TEST_F(ServerStatusPlaces, WhatCannotBeOfTheMapIsRefusedByItsName) {
  hear_returns(kAlpha, {{{kAlpha, 9}, 1, 0, 0, 0}});
  EXPECT_EQ(node_->mission_status(now_).refusals.front().last_why, "how submap 0/9 fits: the map has no such submap");
  hear_returns(kAlpha, {{{kAlpha, 0}, 1, 3, 0, 0}});
  EXPECT_EQ(node_->mission_status(now_).refusals.front().last_why,
            "how submap 0/0 fits: 1 of its points matched and 3 missing, it has 1");
  EXPECT_TRUE(node_->mission_status(now_).places.empty());
}

TEST_F(ServerStatusPlaces, WhoHasNoSubmapsInTheMapIsNotBelieved) {
  accepts_others_ = true;
  restart();
  hear_returns(kStranger, {{{kAlpha, 0}, 0, 1, 0, 0}});
  EXPECT_TRUE(node_->mission_status(now_).places.empty());
}

}  // namespace server_status_test
}  // namespace tutti::node
