// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/robot_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <set>

#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/sqlite_salvage.hpp"

namespace tutti::program {
namespace robot_store_test {

namespace fs = std::filesystem;

constexpr RobotId kRobot{1};
constexpr std::uint64_t kNow_ns = 1'700'000'000'000'000'000;
constexpr std::size_t kWaiting = 7, kPage = 4096;

/// A robot's state folder, with seven submaps that wait.
class RobotStoreTest : public testing::Test {
 protected:
  RobotStoreTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::copy_file(tutti::test::source_path("tests/stored/robot_state_1.tutti"), file_);
    whole_ = read_file(file_.string()).value();
  }
  ~RobotStoreTest() override { fs::remove_all(folder_); }
  [[nodiscard]] RobotStore open() const {
    auto store = open_robot_store(folder_, kNow_ns, {.min_free_bytes = 0});
    EXPECT_TRUE(store.has_value()) << store.error().message;
    return std::move(*store);
  }
  void damage(std::size_t at, std::size_t bytes) {
    std::string damaged = whole_;
    damaged.replace(at, bytes, bytes, '\x55');
    ASSERT_TRUE(write_file(file_.string(), damaged));
  }
  /// Starts the robot; its session, its backlog, and what it reports when it begins.
  struct Started {
    std::uint64_t session = 0;
    std::size_t backlog = 0;
    std::vector<node::Event> events;
    std::string trouble;
  };
  static Started start(storage::TableStore& store) {
    const auto robot = node::RobotNode::open(kRobot, 7, {}, store);
    EXPECT_TRUE(robot.has_value()) << robot.error().message;
    const node::Step step = (*robot)->resume({});
    EXPECT_TRUE(store.commit(step.writes).has_value());
    return {(*robot)->agent().chain().session, (*robot)->backlog().size(), step.events, (*robot)->status({}).trouble};
  }
  [[nodiscard]] std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.insert(entry.path().filename());
    return names;
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("robot_store_" + std::to_string(getpid()));
  const fs::path file_ = folder_ / kRobotFile;
  std::string whole_;
};

TEST_F(RobotStoreTest, AWholeOneIsOpened) {
  const RobotStore opened = open();
  EXPECT_EQ(opened.damage, "");
  EXPECT_EQ(start(*opened.store).session, 101U);
}

/// Any page, the first, or all from the middle on, or nothing left: the robot goes on, with what waits as far as it can
/// be read, and reports it.
TEST_F(RobotStoreTest, ADamagedOneIsSetAsideAndTheRobotGoesOnInANewSession) {
  std::size_t kept_all = 0;
  const std::size_t pages = whole_.size() / kPage;
  for (std::size_t page = 0; page < pages + 2; ++page) {
    SCOPED_TRACE(page);
    for (const std::string& name : files()) fs::remove(folder_ / name);
    if (page < pages)
      damage(page * kPage, kPage);
    else
      ASSERT_TRUE(write_file(file_.string(), page == pages ? whole_.substr(0, whole_.size() / 2) : ""));
    const std::string damaged = read_file(file_.string()).value();
    RobotStore opened = open();
    if (opened.damage.empty()) continue;  // nothing was on this page
    EXPECT_EQ(read_file((folder_ / "robot.damaged-1.tutti").string()).value(), damaged);
    Started robot = start(*opened.store);
    EXPECT_EQ(robot.session, kNow_ns + 1);
    ASSERT_EQ(robot.events.size(), 1U);
    EXPECT_EQ(std::get<node::StateLost>(robot.events[0].what).session, kNow_ns + 1);
    EXPECT_NE(robot.trouble.find("could not be read"), std::string::npos) << robot.trouble;
    kept_all += robot.backlog == kWaiting ? 1 : 0;
    opened.store.reset();
    opened = open();
    EXPECT_EQ(opened.damage, "");
    robot = start(*opened.store);
    EXPECT_EQ(robot.session, kNow_ns + 1);
    EXPECT_TRUE(robot.events.empty());
    opened.store.reset();
    EXPECT_EQ(files(), (std::set<std::string>{"robot.damaged-1.tutti", "robot.tutti"}));
  }
  EXPECT_GT(kept_all, pages / 2);
}

TEST_F(RobotStoreTest, ADamagedRowIsNamed) {
  auto store = open().store;
  std::string bytes;
  ASSERT_TRUE(store->scan("outbox", {}, [&](std::string_view, std::string_view row) { return bytes = row, false; }));
  store.reset();
  const std::size_t at = whole_.find(bytes.substr(bytes.size() - 64));
  ASSERT_NE(at, std::string::npos);
  damage(at + 5, 1);
  const RobotStore opened = open();
  EXPECT_NE(opened.damage.find("outbox: submap 1:101/"), std::string::npos) << opened.damage;
  EXPECT_EQ(start(*opened.store).backlog, kWaiting - 1);
}

/// Killed between any two of the files that change places.
TEST_F(RobotStoreTest, WhoeverIsKilledMeanwhileGoesOn) {
  for (const bool moved : {false, true}) {
    for (const std::string& name : files()) fs::remove(folder_ / name);
    damage(0, kPage);
    ASSERT_TRUE(mapfile::make_store(folder_ / "robot.salvaged.tutti", storage::robot_schema(), [](auto& store) {
      return store.commit(std::vector<storage::Write>{{"meta", "lost", "it was tried"}});
    }));
    if (moved) fs::rename(file_, folder_ / "robot.damaged-1.tutti");
    const RobotStore opened = open();
    EXPECT_EQ(opened.damage, "");
    EXPECT_EQ(opened.store->read("meta", "lost").value(), "it was tried");
  }
}

TEST_F(RobotStoreTest, WhatIsNotDamagedIsLeftAlone) {
  fs::remove(file_);
  storage::Schema newer = storage::robot_schema();
  newer.version += 1;
  newer.tables.emplace_back("of_the_future");
  ASSERT_TRUE(storage::open_sqlite_store(file_, newer, {.min_free_bytes = 0}).has_value());
  EXPECT_EQ(open_robot_store(folder_, kNow_ns).error().code, ErrorCode::unsupported);
  EXPECT_EQ(files(), (std::set<std::string>{"robot.tutti"}));
}

}  // namespace robot_store_test
}  // namespace tutti::program
