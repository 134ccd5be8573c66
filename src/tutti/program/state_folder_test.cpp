// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/state_folder.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tutti/base/file.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::program {
namespace state_folder_test {

namespace fs = std::filesystem;

class StateFolderTest : public testing::Test {
 protected:
  StateFolderTest() { fs::remove_all(folder_); }
  ~StateFolderTest() override { fs::remove_all(folder_); }
  const fs::path folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(StateFolderTest, KeepsItsNumber) {
  std::uint64_t made_ns = 0;
  {
    const auto folder = StateFolder::open(folder_ / "new" / "deep", "robot alpha");
    ASSERT_TRUE(folder.has_value()) << folder.error().message;
    EXPECT_TRUE(folder->is_new());
    made_ns = folder->made_ns();
    EXPECT_GT(made_ns, 1'600'000'000'000'000'000U);
  }
  const auto folder = StateFolder::open(folder_ / "new" / "deep", "robot alpha");
  ASSERT_TRUE(folder.has_value()) << folder.error().message;
  EXPECT_FALSE(folder->is_new());
  EXPECT_EQ(folder->made_ns(), made_ns);
}

TEST_F(StateFolderTest, OthersOfTheMachineReadNothing) {
  umask(0);
  const auto folder = StateFolder::open(folder_ / "deep", "robot alpha");
  ASSERT_TRUE(folder.has_value()) << folder.error().message;
  ASSERT_TRUE(EventLog::open(folder->path(), "alpha", Level::error).has_value());
  ASSERT_TRUE(replace_file(folder->path() / "status.json", "{}", false));
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    const auto mode = static_cast<unsigned>(entry.status().permissions());
    EXPECT_EQ(mode & 0027U, 0U) << entry.path() << " " << mode;
    ++files;
  }
  EXPECT_GE(files, 6);
}

TEST_F(StateFolderTest, IsOneOwnersAndOneProgramsAtATime) {
  const auto refused = [&](const std::string& owner) {
    const auto folder = StateFolder::open(folder_, owner);
    return folder ? std::string() : folder.error().message;
  };
  {
    const auto first = StateFolder::open(folder_, "robot alpha");
    ASSERT_TRUE(first.has_value());
    EXPECT_NE(refused("robot alpha").find("another program"), std::string::npos);
  }
  EXPECT_NE(refused("robot bravo").find("robot alpha"), std::string::npos);
  EXPECT_NE(refused("server").find("robot alpha"), std::string::npos);
  EXPECT_EQ(refused("robot alpha"), "");
}

TEST_F(StateFolderTest, MayBeADiskOfItsOwn) {
  fs::create_directories(folder_ / "lost+found");
  EXPECT_TRUE(StateFolder::open(folder_, "robot alpha").has_value());
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  std::ofstream(folder_ / "lost+found") << "a file of somebody's";
  EXPECT_FALSE(StateFolder::open(folder_, "robot alpha").has_value());
}

TEST_F(StateFolderTest, AKillWhileItIsMadeLeavesWhatTheNextStartTakes) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "lock");
  std::ofstream(folder_ / "owner.new") << "tutti ro";
  const auto folder = StateFolder::open(folder_, "robot alpha");
  ASSERT_TRUE(folder.has_value()) << folder.error().message;
  EXPECT_TRUE(folder->is_new());
  EXPECT_FALSE(fs::exists(folder_ / "owner.new"));
}

TEST_F(StateFolderTest, AFolderWithOtherThingsIsNotTaken) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "thesis.tex") << "important";
  const auto folder = StateFolder::open(folder_, "server");
  ASSERT_FALSE(folder.has_value());
  EXPECT_NE(folder.error().message.find("thesis.tex"), std::string::npos);
}

TEST_F(StateFolderTest, AMapThatWasBroughtIsTaken) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "map.tutti") << "a map";
  std::ofstream(folder_ / "map.tutti-wal") << "and its log";
  EXPECT_FALSE(StateFolder::open(folder_, "robot alpha").has_value());
  const auto folder = StateFolder::open(folder_, "server", "map.tutti");
  ASSERT_TRUE(folder.has_value()) << folder.error().message;
  EXPECT_TRUE(folder->is_new());
}

TEST_F(StateFolderTest, OfSomebodyElsesFolderNoLinkIsFollowed) {
  fs::create_directories(folder_ / "state");
  const fs::path foreign = folder_ / "foreign";
  std::ofstream(foreign) << "of somebody else";
  fs::create_symlink(foreign, folder_ / "state" / "owner.new");
  {
    const auto folder = StateFolder::open(folder_ / "state", "server");
    ASSERT_TRUE(folder.has_value()) << folder.error().message;
  }
  fs::remove(folder_ / "state" / "lock");
  fs::create_symlink(foreign, folder_ / "state" / "lock");
  EXPECT_FALSE(StateFolder::open(folder_ / "state", "server").has_value());
  EXPECT_EQ(read_file(foreign.string()).value(), "of somebody else");
}

TEST_F(StateFolderTest, EventsComeBackInTheirOrderAndWithoutWhatAKillHasTorn) {
  fs::create_directories(folder_);
  {
    const auto log = EventLog::open(folder_, "test", Level::error).value();
    log->write(node::Event{Timestamp{1'500'000'000}, node::MapUpdated{3, 20, 7, 1.5, 12, true}});
  }
  std::ofstream(folder_ / "events.jsonl", std::ios::app) << R"({"time_s": 2, "even)";
  {
    const auto log = EventLog::open(folder_, "test", Level::error).value();
    log->write(node::Event{Timestamp{2'500'000'000}, node::SubmapStored{{RobotId{1}, 2}}});
  }
  std::vector<Json> events;
  ASSERT_TRUE(read_events(folder_, [&](const Json& event) { events.push_back(event); }).has_value());
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].dump(),
            R"({"time_s":1.5,"event":"map_updated","revision":3,"submaps":20,"accepted":7,"cost":1.5,)"
            R"("degrees_of_freedom":12,"from_measurements":true})");
  EXPECT_EQ(events[1]["submap"], "1/2");
  EXPECT_FALSE(read_events(folder_ / "nowhere", [](const Json&) {}).has_value());
}

}  // namespace state_folder_test
}  // namespace tutti::program
