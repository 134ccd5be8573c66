// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/salvage.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <set>

#include "support/mapfile/small_map.hpp"
#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {
namespace salvage_test {

namespace fs = std::filesystem;
using test::Mapper;
constexpr RobotId kAlpha{0};
constexpr std::uint64_t kNow_ns = 1'700'000'000'000'000'000;
const ChainId kWalk{kAlpha, 5};

/// A map in a file.
class SalvagedMap : public testing::Test {
 protected:
  SalvagedMap() {
    fs::create_directories(folder_);
    const auto store = storage::open_sqlite_store(map_, storage::map_schema(), {.min_free_bytes = 0}).value();
    Mapper mapper({kAlpha}, *store);
    mapper.walk(kWalk);
    submaps_ = mapper.server().state().submaps.size();
  }
  ~SalvagedMap() override { fs::remove_all(folder_); }
  /// Turns a bit of this row.
  void damage(const std::string& table, const std::string& key) {
    const std::string bytes = **open(map_).value()->read(table, key);
    std::string file = read_file(map_.string()).value();
    const std::size_t at = file.find(bytes.substr(bytes.size() - std::min<std::size_t>(bytes.size(), 64)));
    ASSERT_NE(at, std::string::npos);
    file[at + 5] ^= 0x10;
    ASSERT_TRUE(write_file(map_.string(), file));
  }
  const fs::path folder_ = fs::path(testing::TempDir()) / ("salvage_map_" + std::to_string(getpid()));
  const fs::path map_ = folder_ / "map.tutti", out_ = folder_ / "out.tutti";
  std::size_t submaps_ = 0;
};

TEST_F(SalvagedMap, LacksTheDamagedRowWhichIsNamedAndTakesItWhenItComesAgain) {
  damage("submaps", node::key_of(SubmapId{kWalk, 2}));
  EXPECT_FALSE(read(*open(map_).value()).has_value());
  const std::string before = read_file(map_.string()).value();
  const auto salvaged = salvage(map_, out_, kNow_ns);
  ASSERT_TRUE(salvaged.has_value()) << salvaged.error().message;
  EXPECT_EQ(salvaged->rows.at("submaps"), submaps_ - 1);
  ASSERT_EQ(salvaged->lost.size(), 1U);
  EXPECT_NE(salvaged->lost[0].find("submaps: submap 0:5/2: "), std::string::npos) << salvaged->lost[0];
  EXPECT_EQ(read_file(map_.string()).value(), before);
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder_)) files.insert(entry.path().filename());
  EXPECT_EQ(files, (std::set<std::string>{"map.tutti", "out.tutti"}));

  const auto store = open(out_).value();
  EXPECT_EQ(read(*store)->submaps.size(), submaps_ - 1);
  EXPECT_TRUE(read(*store)->meta.news);
  Mapper mapper({kAlpha}, *store);
  mapper.walk(kWalk);  // the robot sends all that it has
  EXPECT_EQ(mapper.server().state().submaps.size(), submaps_);
  EXPECT_EQ(mapper.server().map().components, 1U);
}

TEST_F(SalvagedMap, WithoutItsOwnRowGoesOn) {
  damage("meta", "map");
  EXPECT_FALSE(read(*open(map_).value()).has_value());
  ASSERT_TRUE(salvage(map_, out_, kNow_ns).has_value());
  const auto store = open(out_).value();
  Mapper mapper({kAlpha}, *store);
  EXPECT_EQ(mapper.server().state().submaps.size(), submaps_);
}

/// The first page is the same in every map; a map that was cut short lacks what was behind the cut.
TEST_F(SalvagedMap, WithoutItsFirstPageIsWholeAndACutOneHasWhatIsBefore) {
  const std::string whole = read_file(map_.string()).value();
  std::string damaged = whole;
  damaged.replace(0, 4096, 4096, '\x55');
  ASSERT_TRUE(write_file(map_.string(), damaged));
  EXPECT_NE(open(map_).error().message.find("tutti map salvage"), std::string::npos) << open(map_).error().message;
  const auto salvaged = salvage(map_, out_, kNow_ns);
  ASSERT_TRUE(salvaged.has_value()) << salvaged.error().message;
  EXPECT_EQ(salvaged->kind, "map");
  EXPECT_EQ(read(*open(out_).value())->submaps.size(), submaps_);

  fs::remove(out_);
  ASSERT_TRUE(write_file(map_.string(), whole.substr(0, whole.size() - 4096)));
  EXPECT_EQ(open(map_).error().message.find("PRAGMA"), std::string::npos) << open(map_).error().message;
  EXPECT_NE(open(map_).error().message.find("tutti map salvage"), std::string::npos) << open(map_).error().message;
  const auto cut = salvage(map_, out_, kNow_ns);
  ASSERT_TRUE(cut.has_value()) << cut.error().message;
  EXPECT_FALSE(cut->lost.empty());
  EXPECT_GE(read(*open(out_).value())->submaps.size() + 2, submaps_);
}

TEST_F(SalvagedMap, OfNoBytesIsRefused) {
  ASSERT_TRUE(write_file(map_.string(), ""));
  EXPECT_NE(open(map_).error().message.find("0 bytes"), std::string::npos) << open(map_).error().message;
  EXPECT_EQ(salvage(map_, out_, kNow_ns).error().message, map_.string() + ": 0 bytes, which hold no row");
}

/// SQLite's own words are of two lines: "*** in database main ***" and what it is.
TEST_F(SalvagedMap, WithADamagedPageIsReportedInOneLine) {
  std::string damaged = read_file(map_.string()).value();
  const std::size_t pages = damaged.size() / 4096;
  for (std::size_t page = 2; page < pages; page += 2) damaged.replace(4096 * page, 4096, 4096, '\x55');
  ASSERT_TRUE(write_file(map_.string(), damaged));
  const auto opened = open(map_);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().message.find('\n'), std::string::npos) << opened.error().message;
}

TEST_F(SalvagedMap, ARobotsStoreGivesItsSubmapsAndBeginsASession) {
  const fs::path file = folder_ / "robot.tutti";
  fs::copy_file(tutti::test::source_path("tests/stored/robot_state_1.tutti"), file);  // seven submaps wait
  std::string bytes = read_file(file.string()).value();
  bytes.replace(0, 4096, 4096, '\x55');
  ASSERT_TRUE(write_file(file.string(), bytes));
  const auto salvaged = salvage(file, out_, kNow_ns);
  ASSERT_TRUE(salvaged.has_value()) << salvaged.error().message;
  EXPECT_EQ(salvaged->kind, "robot");
  EXPECT_EQ(salvaged->rows.at("outbox"), 7U);
  EXPECT_FALSE(salvaged->rows.contains("checkpoint"));
  const auto store = storage::open_sqlite_store(out_, storage::robot_schema(), {.min_free_bytes = 0}).value();
  const auto robot = node::RobotNode::open(RobotId{1}, 7, {}, *store);
  ASSERT_TRUE(robot.has_value()) << robot.error().message;
  EXPECT_EQ((*robot)->backlog().size(), 7U);
  EXPECT_EQ((*robot)->agent().chain().session, kNow_ns + 1);
  const node::Step step = (*robot)->resume({});
  ASSERT_EQ(step.events.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<node::StateLost>(step.events[0].what));
  EXPECT_NE((*robot)->status({}).trouble.find("salvaged by hand"), std::string::npos) << (*robot)->status({}).trouble;
  ASSERT_TRUE(store->commit(step.writes).has_value());
  EXPECT_TRUE(node::RobotNode::open(RobotId{1}, 7, {}, *store).value()->resume({}).events.empty());
}

TEST_F(SalvagedMap, IsNotThereWhenItFails) {
  EXPECT_FALSE(salvage(folder_ / "missing", out_, kNow_ns).has_value());
  EXPECT_FALSE(salvage(map_, map_, kNow_ns).has_value());
  ASSERT_TRUE(write_file((folder_ / "garbage").string(), std::string(9000, 'x')));
  EXPECT_FALSE(salvage(folder_ / "garbage", out_, kNow_ns).has_value());
  EXPECT_FALSE(fs::exists(out_));
}

}  // namespace salvage_test
}  // namespace tutti::mapfile
