// SPDX-License-Identifier: BSD-3-Clause
// A robot's store: what is written to it, and how one that another version has written is read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "support/paths.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"

namespace tutti::node {
namespace robot_state_test {

constexpr RobotId kRobot{1};

std::size_t bytes_of(const Step& step) {
  std::size_t bytes = 0;
  for (const storage::Write& write : step.writes) bytes += write.key.size() + (write.bytes ? write.bytes->size() : 0);
  return bytes;
}

struct Robot {
  explicit Robot(const storage::TableStore& of, std::uint64_t session = 101)
      : node(RobotNode::open(kRobot, session, {}, of).value()) {}
  /// A sample of a robot that walks on and on, half a metre and half a second each.
  Step walk(int i) {
    const Timestamp stamp = robot::test::at(i);
    if (i > 0) T_odom_body = T_odom_body * (robot::test::true_pose(i - 1).inverse() * robot::test::true_pose(i)) * bend;
    return node->add(OdometrySample{stamp, T_odom_body, robot::test::kStepCovariance}, Timestamp{} + 0.5 * i);
  }
  Step hear(const ProxyGraphMessage& message, Timestamp now) const {
    return node->receive({bus::Endpoint::server(),
                          bus::Endpoint::of(kRobot),
                          bus::MessageKind::proxy_graph,
                          {},
                          std::make_shared<const std::string>(wire::encode(message))},
                         now);
  }
  std::unique_ptr<RobotNode> node;
  Pose3 T_odom_body;
  const Pose3 bend = (robot::test::true_pose(0).inverse() * robot::test::true_pose(1)).inverse() *
                     robot::test::drifting_odometry(2)[1].pose;
};

// A checkpoint used to be the whole trajectory so far.
TEST(RobotState, WhatASubmapWritesDoesNotGrowWithTheTrajectory) {
  storage::MemoryStore store(storage::robot_schema());
  Robot robot(store);
  ASSERT_TRUE(store.commit(robot.node->resume({}).writes).has_value());
  std::vector<std::size_t> of_submaps{0};
  constexpr int kSamples = 3000;
  for (int i = 0; i < kSamples; ++i) {
    const Step step = robot.walk(i);
    of_submaps.back() += bytes_of(step);
    ASSERT_TRUE(store.commit(step.writes).has_value());
    if (!step.messages.empty()) of_submaps.push_back(0);
  }
  of_submaps.pop_back();
  ASSERT_GT(of_submaps.size(), 100U);
  const auto mean = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) sum += static_cast<double>(of_submaps[i]) / static_cast<double>(to - from);
    return sum;
  };
  const std::size_t n = of_submaps.size();
  RecordProperty("bytes_per_submap", static_cast<int>(mean(n / 2, n)));
  EXPECT_LT(mean(n - n / 10, n), 1.1 * mean(n / 10, n / 5));
  EXPECT_LT(static_cast<double>(*std::ranges::max_element(of_submaps)), 2.0 * mean(0, n));
}

TEST(RobotState, OfTheLinksToTheMapOnlyThoseThatChangedAreWritten) {
  storage::MemoryStore store(storage::robot_schema());
  Robot robot(store);
  const auto done = [&](const Step& step) { ASSERT_TRUE(store.commit(step.writes).has_value()); };
  done(robot.node->resume({}));
  const auto links_in = [](const Step& step) {
    return std::ranges::count_if(step.writes, [](const storage::Write& w) { return w.key.starts_with("link/"); });
  };
  int i = 0;
  const auto to_the_next_submap = [&] {
    while (true) {
      Step step = robot.walk(i++);
      done(step);
      if (!step.messages.empty()) return step;
    }
  };
  while (i < 130) to_the_next_submap();
  const ProxyGraphMessage graph = robot::test::broadcast(robot.node->agent(), 1, robot::test::kWorld);
  done(robot.hear(graph, Timestamp{} + 0.5 * i));
  const std::size_t links = robot.node->agent().ledger().size();
  ASSERT_GT(links, 1U);
  EXPECT_EQ(links_in(to_the_next_submap()), static_cast<std::ptrdiff_t>(links));
  EXPECT_EQ(links_in(to_the_next_submap()), 0);
  ProxyGraphMessage other = graph;  // the end that the links are fixed to is no longer known: some links go
  other.graph.revision = 2;
  other.graph.nodes.erase(other.graph.nodes.begin() + 40, other.graph.nodes.end() - 1);
  other.graph.uncertainties.clear();
  done(robot.hear(other, Timestamp{} + 0.5 * i));
  const consistency::Ledger ledger = robot.node->agent().ledger();
  ASSERT_LT(ledger.size(), links);
  to_the_next_submap();
  EXPECT_EQ(std::ranges::count_if(store.tables().at("checkpoint"),
                                  [](const auto& row) { return row.first.starts_with("link/"); }),
            static_cast<std::ptrdiff_t>(ledger.size()));
  EXPECT_EQ(Robot(store).node->agent().ledger(), ledger);
}

/// tests/stored/robot_state_N.tutti: a robot's store with all that a state may have: a graph's constraints, a jump of
/// odometry, a receiver, and scans and fixes that come before the odometry that they wait for. Version 1's is of a
/// walk, each later one is what the program of version N makes of the file before. Whoever raises the version writes
/// the new one: test_node --gtest_also_run_disabled_tests --gtest_filter='*WritesTheStoredFile'.
std::filesystem::path stored_file(unsigned version) {
  return tutti::test::source_path("tests/stored/robot_state_" + std::to_string(version) + ".tutti");
}
constexpr wire::MessageKind kState = wire::MessageKind::agent_state;
constexpr std::size_t kWaiting = 7;  // submaps in its outbox

storage::MemoryStore::Tables stored_tables(unsigned version) {
  const auto file = std::filesystem::path(testing::TempDir()) / "robot_state.tutti";
  std::filesystem::copy_file(stored_file(version), file, std::filesystem::copy_options::overwrite_existing);
  const auto stored = storage::open_sqlite_store(file, storage::robot_schema(), {.min_free_bytes = 0}).value();
  storage::MemoryStore::Tables tables;
  for (const std::string& table : storage::robot_schema().tables)
    EXPECT_TRUE(stored->scan(table, {}, [&](std::string_view key, std::string_view bytes) {
      return tables[table].emplace(key, bytes).second;
    }));
  return tables;
}

TEST(RobotState, WhoseRowsCannotBeReadBeginsASessionAndKeepsItsOutbox) {
  const auto whole = stored_tables(wire::versions(kState).current);
  for (const bool newer : {true, false})
    for (const char* table : {"checkpoint", "journal"}) {
      auto tables = whole;
      std::string& row = tables.at(table).begin()->second;
      row[table == std::string("checkpoint") ? 2 : 0] = newer ? '\x7f' : '\0';  // version; kind of entry
      storage::MemoryStore store(storage::robot_schema(), tables);
      Robot robot(store, 7);
      EXPECT_EQ(robot.node->agent().chain().session, 102U);  // after that of the submaps that wait
      EXPECT_EQ(robot.node->backlog().size(), kWaiting);
      const Step resumed = robot.node->resume({});
      ASSERT_EQ(resumed.events.size(), 1U);
      const auto& lost = std::get<StateLost>(resumed.events[0].what);
      EXPECT_EQ(lost.session, 102U);
      EXPECT_NE(lost.why.find(table), std::string::npos) << lost.why;
      EXPECT_EQ(resumed.messages.size(), kWaiting);
      ASSERT_TRUE(store.commit(resumed.writes).has_value());
      EXPECT_TRUE(store.tables().at("journal").empty());
      const auto kept = store.tables().at("checkpoint");  // what is not understood is not removed
      for (const char* from : {"checkpoint", "journal"})
        for (const auto& [key, bytes] : tables.at(from))
          EXPECT_EQ(kept.at(std::string("aside/101/") + from + "/" + key), bytes);
      Robot again(store, 7);
      EXPECT_TRUE(again.node->resume({}).events.empty());
      EXPECT_EQ(again.node->agent().chain().session, 102U);
    }
}

TEST(RobotState, DISABLED_WritesTheStoredFile) {
  const unsigned version = wire::versions(kState).current;
  auto tables = stored_tables(version - 1);
  auto& checkpoint = tables.at("checkpoint");
  const robot::RobotAgent agent(kRobot, {}, wire::decode_state_rows({checkpoint.begin(), checkpoint.end()}).value());
  wire::StoredState nothing;
  checkpoint.clear();
  for (auto& [key, bytes] : wire::changed_rows(agent, nothing).put) checkpoint.emplace(key, bytes);
  std::vector<storage::Write> rows;
  for (const auto& [table, of_table] : tables)
    for (const auto& [key, bytes] : of_table) rows.push_back({table, key, bytes});
  std::filesystem::remove(stored_file(version));
  ASSERT_TRUE(storage::open_sqlite_store(stored_file(version), storage::robot_schema(), {.min_free_bytes = 0})
                  .value()
                  ->commit(rows));
}

/// Back and forth between the versions whose states are rows: what the program before wrote is read to the bit.
TEST(RobotState, OfEveryVersionOnIsReadToTheBit) {
  std::string before;
  for (unsigned version = 1; version <= wire::versions(kState).current; ++version) {
    SCOPED_TRACE(version);
    const storage::MemoryStore store(storage::robot_schema(), stored_tables(version));
    const auto tables = store.tables();
    for (const auto& [key, bytes] : tables.at("checkpoint")) EXPECT_EQ(wire::version_of(bytes), version) << key;
    const Robot robot(store, 7);
    EXPECT_TRUE(robot.node->resume({}).events.empty());
    EXPECT_EQ(robot.node->agent().chain().session, 101U);
    EXPECT_GT(robot.node->agent().ledger().size(), 0U);
    const std::string state = wire::encode(robot.node->agent().state());
    if (!before.empty()) {
      EXPECT_EQ(state, before);
    }
    before = state;
  }
}

/// Whoever adds to what a row contains raises the version of the agent state (docs/storage.md): an older program of the
/// same version would take the row for garbage.
TEST(RobotState, IsWrittenAsItsVersionWasWhenItWasRaised) {
  const auto tables = stored_tables(wire::versions(kState).current);
  const auto& stored = tables.at("checkpoint");
  auto state = wire::decode_state_rows({stored.begin(), stored.end()});
  ASSERT_TRUE(state.has_value()) << state.error().message;
  const robot::RobotAgent agent(kRobot, {}, std::move(*state));
  wire::StoredState nothing;
  const wire::StateRows rows = wire::changed_rows(agent, nothing).put;
  const auto payload = [](const std::string& frame) { return wire::unpack_frame(kState, frame).value(); };
  for (const char* key : {"head", "corrections"}) EXPECT_EQ(payload(rows.at(key)), payload(stored.at(key))) << key;
}

/// The next version is simulated by frames that are numbered one higher: the program before leaves them, begins a
/// session, and keeps what waits; the next one, which is back, goes on with that.
TEST(RobotState, OneVersionBackAndForthLosesNothing) {
  auto tables = stored_tables(wire::versions(kState).current);
  const std::size_t waiting = tables.at("outbox").size();
  ASSERT_GT(waiting, 0U);
  for (auto& [key, bytes] : tables.at("checkpoint")) ++bytes[2];  // the frame's version
  storage::MemoryStore store(storage::robot_schema(), tables);
  std::size_t made = 0;
  {
    Robot back(store, 7);
    const Step resumed = back.node->resume({});
    ASSERT_EQ(resumed.events.size(), 1U);
    EXPECT_NE(std::get<StateLost>(resumed.events[0].what).why.find("of version"), std::string::npos);
    EXPECT_NE(back.node->status({}).trouble.find("session 102"), std::string::npos);
    ASSERT_TRUE(store.commit(resumed.writes).has_value());
    for (int i = 0; i < 60; ++i) ASSERT_TRUE(store.commit(back.walk(i).writes).has_value());
    made = back.node->backlog().size() - waiting;
    EXPECT_GT(made, 0U);
  }
  Robot forth(store, 7);
  EXPECT_TRUE(forth.node->resume({}).events.empty());
  EXPECT_EQ(forth.node->agent().chain().session, 102U);
  EXPECT_EQ(forth.node->backlog().size(), waiting + made);
  for (const auto& [key, bytes] : tables.at("checkpoint"))
    EXPECT_EQ(store.tables().at("checkpoint").at("aside/101/checkpoint/" + key), bytes);
}

TEST(RobotState, WithoutACheckpointNoSessionIsBegunTwice) {
  storage::MemoryStore store(storage::robot_schema(), {{"meta", {{"session", storage::key_of({101})}}}});
  EXPECT_EQ(Robot(store, 101).node->agent().chain().session, 102U);
  EXPECT_EQ(Robot(store, 200).node->agent().chain().session, 200U);
  EXPECT_EQ(Robot(storage::MemoryStore(storage::robot_schema()), 0).node->agent().chain().session, 0U);
}

TEST(RobotState, OfAnotherRobotIsRefusedWithBothNumbers) {
  storage::MemoryStore store(storage::robot_schema(), stored_tables(wire::versions(kState).current));
  const auto node = RobotNode::open(RobotId{7}, 101, {}, store);
  ASSERT_FALSE(node.has_value());
  EXPECT_NE(node.error().message.find("what is stored is robot 1's, expected robot 7's"), std::string::npos)
      << node.error().message;
}

/// Another version may have rows of its own there.
TEST(RobotState, WhatIsNoSubmapInTheOutboxIsLeftAlone) {
  storage::MemoryStore store(storage::robot_schema(), {{"outbox", {{"later", "1"}}}, {"archive", {{"later", ""}}}});
  Robot robot(store);
  EXPECT_TRUE(robot.node->backlog().empty());
  ASSERT_TRUE(store.commit(robot.node->resume({}).writes).has_value());
  EXPECT_TRUE(store.tables().at("outbox").contains("later"));
}

}  // namespace robot_state_test
}  // namespace tutti::node
