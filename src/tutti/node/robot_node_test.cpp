// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/robot/drifting_robot.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/agent_state.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

using bus::Endpoint, bus::MessageKind;
constexpr RobotId kRobot{1};

bus::Envelope from_server(MessageKind kind, std::string bytes) {
  return {Endpoint::server(), Endpoint::of(kRobot), kind, {}, std::make_shared<const std::string>(std::move(bytes))};
}

/// A robot on a store, whose steps are committed.
class RobotNodeTest : public testing::Test {
 protected:
  RobotNodeTest() { restart(); }
  void restart() {
    store_ = std::make_unique<storage::MemoryStore>(storage::robot_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = RobotNode::open(kRobot, 100 + ++starts_, config_, Rng(1), *store_).value();
    resumed_ = done(node_->resume(now_));
  }
  Step done(Step step) {
    EXPECT_TRUE(store_->commit(step.writes).has_value());
    for (const bus::Envelope& message : step.messages) sent_.push_back(message);
    return step;
  }
  void walk(int from, int to) {
    for (int i = from; i < to; ++i) {
      done(node_->add_odometry({odometry_[i].stamp, odometry_[i].pose, robot::test::kStepCovariance}, now_));
      if (!node_->agent().wants_scan()) continue;
      PointCloud cloud;
      cloud.points.emplace_back(1.0F * static_cast<float>(i), 5.0F, 1.0F);
      done(node_->add_scan({odometry_[i].stamp, std::make_shared<const PointCloud>(cloud), {}}, now_));
    }
  }
  Step hear(std::uint64_t revision) {
    const auto message = robot::test::broadcast(node_->agent(), revision, robot::test::kWorld);
    return done(node_->receive(from_server(MessageKind::proxy_graph, wire::encode(message)), now_));
  }
  Step confirm(const std::vector<SubmapId>& ids, RobotId robot = kRobot) {
    Receipt receipt{.robot = robot, .stored = {}};
    for (const SubmapId id : ids) receipt.stored[id.chain.session].insert(id.index);
    return done(node_->receive(from_server(MessageKind::receipt, wire::encode(receipt)), now_));
  }
  [[nodiscard]] std::size_t rows(const char* table) const { return store_->tables().at(table).size(); }

  const Trajectory odometry_ = robot::test::drifting_odometry(200);
  RobotNodeConfig config_;
  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<RobotNode> node_;
  Step resumed_;
  std::vector<bus::Envelope> sent_;
  std::uint64_t starts_ = 0;
  Timestamp now_;
};

TEST_F(RobotNodeTest, GoesOnFromItsStoreToTheBit) {
  walk(0, 130);
  hear(1);
  walk(130, 160);
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
  const std::set<SubmapId> all = node_->backlog();
  ASSERT_GE(all.size(), 4U);
  EXPECT_EQ(rows("outbox"), all.size());
  ASSERT_EQ(sent_.size(), all.size());
  EXPECT_EQ(sent_[1].id, "1/101/1");
  EXPECT_EQ(sent_[1].kind, MessageKind::submap);
  const SubmapId first = *all.begin(), last = *all.rbegin();
  confirm({first, last});
  EXPECT_EQ(rows("outbox"), all.size() - 2);
  const std::vector<bus::Envelope> before = std::exchange(sent_, {});
  restart();
  ASSERT_EQ(sent_.size(), all.size() - 2);  // the others once more, as they were
  EXPECT_EQ(*sent_[0].bytes, *before[1].bytes);
  EXPECT_EQ(sent_[0].id, before[1].id);
  confirm({first, last});
  confirm({all.begin(), all.end()});
  EXPECT_TRUE(node_->backlog().empty());
  EXPECT_EQ(rows("outbox"), 0U);
}

TEST_F(RobotNodeTest, RefusesWhatIsNotForIt) {
  walk(0, 50);
  const auto before = store_->tables();
  for (const Step& step : {confirm({{{RobotId{2}, 101}, 0}}, RobotId{2}),
                           done(node_->receive(from_server(MessageKind::receipt, "garbage"), now_)),
                           done(node_->receive(from_server(MessageKind::proxy_graph, "garbage"), now_)),
                           done(node_->receive(from_server(MessageKind::job, "garbage"), now_)),
                           done(node_->add_odometry({odometry_[3].stamp, {}, {}}, now_)),
                           done(node_->add_scan({odometry_[3].stamp, std::make_shared<PointCloud>(), {}}, now_))})
    EXPECT_EQ(step.events.size(), 1U);
  EXPECT_EQ(store_->tables(), before);
}

TEST_F(RobotNodeTest, AScanThatComesAgainCountsOnce) {
  walk(0, 51);
  ASSERT_TRUE(node_->agent().wants_scan());
  const std::size_t scans = node_->agent().state().submaps.scans.size();
  PointCloud cloud;
  cloud.points.emplace_back(1.0F, 5.0F, 1.0F);
  const Scan again{odometry_[50].stamp, std::make_shared<const PointCloud>(cloud), {}};
  EXPECT_TRUE(done(node_->add_scan(again, now_)).writes.empty());
  restart();
  EXPECT_TRUE(done(node_->add_scan(again, now_)).writes.empty());
  EXPECT_EQ(node_->agent().state().submaps.scans.size(), scans);
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
  EXPECT_FALSE(RobotNode::open(RobotId{2}, 1, config_, Rng(1), *store_).has_value());
  for (const char* table : {"checkpoint", "journal", "meta"}) {
    auto tables = store_->tables();
    ASSERT_FALSE(tables.at(table).empty()) << table;
    tables.at(table).begin()->second.pop_back();
    const storage::MemoryStore damaged(storage::robot_schema(), tables);
    EXPECT_FALSE(RobotNode::open(kRobot, 1, config_, Rng(1), damaged).has_value()) << table;
  }
}

}  // namespace
}  // namespace tutti::node
