// SPDX-License-Identifier: BSD-3-Clause
// A map that is held, extended and taken back.
#include "tutti/mapfile/versions.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "support/mapfile/small_map.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/robot_registry.hpp"

namespace tutti::mapfile {
namespace versions_test {

using test::Mapper;
namespace fs = std::filesystem;

const RobotId kAlpha{0}, kBravo{1}, kCharlie{2}, kAlphaAgain{3};
constexpr std::int64_t kMonday_ns = 1'700'000'000'000'000'000, kTuesday_ns = kMonday_ns + 86'400'000'000'000;

class Versions : public ::testing::Test {
 protected:
  Versions() : folder_(fs::path(testing::TempDir()) / ("versions_" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Versions() override { fs::remove_all(folder_); }

  static void name(storage::TableStore& store, RobotId robot, const std::string& as) {
    const storage::Write row{"meta", node::RobotRegistry::key(robot), encode(node::RobotRow{as, 0})};
    ASSERT_TRUE(store.commit(std::vector<storage::Write>{row}).has_value());
  }
  static std::map<KeyframeId, Pose3> poses(const fs::path& file) {
    std::map<KeyframeId, Pose3> out;
    for (const MapNode& node : estimate(content(file)).nodes) out[node.id] = node.T_world_body;
    return out;
  }
  static Content content(const fs::path& file) { return read(**open(file)).value(); }

  /// Alpha and bravo on Monday.
  fs::path monday() {
    storage::MemoryStore store(storage::map_schema());
    Mapper mapper({kAlpha, kBravo}, store);
    mapper.walk({kAlpha, 0});
    mapper.walk({kBravo, 0});
    name(store, kAlpha, "alpha");
    name(store, kBravo, "bravo");
    EXPECT_TRUE(copy_map(store, folder_ / "monday"));
    return folder_ / "monday";
  }
  /// Alpha once more, under another number, and charlie on Tuesday.
  fs::path tuesday(const fs::path& before, const char* file = "tuesday") {
    const HeldMap held = read_held(before, kMonday_ns).value();
    EXPECT_EQ(held.free_robot, kCharlie);
    storage::MemoryStore store(storage::map_schema(), held.rows);
    Mapper mapper({kCharlie, kAlphaAgain}, store);
    mapper.walk({kCharlie, 0}, 5);
    mapper.walk({kAlphaAgain, 0}, 6);
    name(store, kCharlie, "charlie");
    name(store, kAlphaAgain, "alpha");
    EXPECT_TRUE(keep_extended(held, store, folder_ / file));
    return folder_ / file;
  }

  fs::path folder_;
};

TEST_F(Versions, AMapThatWasNeverHeldHasOne) {
  const auto all = versions(**open(monday())).value();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all.front().held_ns, 0);
  EXPECT_EQ(all.front().chains, (std::set<ChainId>{{kAlpha, 0}, {kBravo, 0}}));
}

TEST_F(Versions, ARobotOfTheSameNameIsThatRobotInAnotherSession) {
  const fs::path before = monday(), after = tuesday(before);
  const Content both = content(after);
  EXPECT_EQ(both.names, (std::map<RobotId, std::string>{{kAlpha, "alpha"}, {kBravo, "bravo"}, {kCharlie, "charlie"}}));
  const auto all = versions(**open(after)).value();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].held_ns, kMonday_ns);
  EXPECT_EQ(all[0].chains, (std::set<ChainId>{{kAlpha, 0}, {kBravo, 0}}));
  EXPECT_EQ(all[1].number, 2U);
  EXPECT_EQ(all[1].chains, (std::set<ChainId>{{kAlpha, 1}, {kCharlie, 0}}));
  const auto held = poses(before), now = poses(after);
  for (const auto& [id, pose] : held) EXPECT_EQ(now.at(id), pose) << "held to the bit";
  const server::MapEstimate made = estimate(both);
  EXPECT_EQ(made.components, 1U);
  const auto sizes = sizes_of(all, both, made);
  ASSERT_EQ(sizes.size(), 2U);
  EXPECT_EQ(sizes[0].earlier_closures, 0U);
  EXPECT_GT(sizes[1].earlier_closures, 10U);
  EXPECT_GT(sizes[1].own_closures, 0U);
  EXPECT_EQ(sizes[0].submaps + sizes[1].submaps, both.submaps.size());
}

TEST_F(Versions, WhatIsHeldAgainIsTheNextOne) {
  const fs::path after = tuesday(monday());
  const auto was = poses(after);
  const auto held = copy_held(after, folder_ / "wednesday", kTuesday_ns);
  ASSERT_TRUE(held.has_value()) << held.error().message;
  EXPECT_EQ(*held, was.size());
  const auto all = versions(**open(folder_ / "wednesday")).value();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1].held_ns, kTuesday_ns);
  EXPECT_EQ(poses(folder_ / "wednesday"), was);
  EXPECT_EQ(content(folder_ / "wednesday").held.size(), was.size());
}

/// Finds nothing between bravo and the others until it is told to.
class Apart final : public server::WrappedVerifier {
 public:
  Apart() : WrappedVerifier(std::make_shared<server::test::TestVerifier>(7)) {}
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = wrapped().verify(first, second, payloads);
    if (is_apart && (first.id.chain.robot == kBravo) != (second.id.chain.robot == kBravo)) verdict->closures.clear();
    return verdict;
  }
  bool is_apart = true;
};

TEST_F(Versions, FloorsAreHeldEachInItsWorldAndOfJoinedOnesTheFirst) {
  const auto verifier = std::make_shared<Apart>();
  storage::MemoryStore store(storage::map_schema());
  Mapper mapper({kAlpha, kBravo}, store, verifier, {});
  mapper.walk({kAlpha, 0});
  mapper.walk({kBravo, 0});
  ASSERT_EQ(mapper.server().map().components, 2U);
  ASSERT_TRUE(copy_map(store, folder_ / "monday"));
  const auto was = poses(folder_ / "monday");
  const HeldMap held = read_held(folder_ / "monday", kMonday_ns).value();
  for (const bool is_apart : {true, false}) {
    verifier->is_apart = is_apart;
    storage::MemoryStore today(storage::map_schema(), held.rows);
    Mapper extends({kCharlie}, today, verifier, {});
    extends.walk({kCharlie, 0}, 5);
    const fs::path file = folder_ / (is_apart ? "apart" : "joined");
    ASSERT_TRUE(keep_extended(held, today, file));
    const server::MapEstimate made = estimate(content(file));
    EXPECT_EQ(made.components, is_apart ? 2U : 1U);
    for (const MapNode& node : made.nodes)
      if (const auto before = was.find(node.id); before != was.end() && (is_apart || node.id.chain.robot == kAlpha)) {
        EXPECT_EQ(node.T_world_body, before->second);
      }
    ASSERT_TRUE(copy_held(file, folder_ / (file.filename().string() + "_held"), kTuesday_ns).has_value());
    std::map<RobotId, std::set<std::uint32_t>> floors;
    for (const auto& [id, pose] : content(folder_ / (file.filename().string() + "_held")).held)
      floors[id.chain.robot].insert(pose.floor);
    EXPECT_EQ(floors.at(kAlpha), floors.at(kCharlie));
    EXPECT_EQ(floors.at(kAlpha) == floors.at(kBravo), !is_apart);
  }
}

TEST_F(Versions, RevertedIsAsItWas) {
  const fs::path before = monday(), after = tuesday(before);
  const auto left_out = revert(after, 1, folder_ / "reverted");
  ASSERT_TRUE(left_out.has_value()) << left_out.error().message;
  const Content was = content(before), is = content(folder_ / "reverted");
  EXPECT_EQ(*left_out, content(after).submaps.size() - was.submaps.size());
  EXPECT_EQ(poses(folder_ / "reverted"), poses(before));
  EXPECT_EQ(is.submaps.size(), was.submaps.size());
  EXPECT_EQ(is.names, was.names);
  EXPECT_EQ(is.verdicts, was.verdicts);
  EXPECT_EQ(is.refused, was.refused);
  EXPECT_EQ(versions(**open(folder_ / "reverted")).value().size(), 1U);
  const fs::path again = tuesday(folder_ / "reverted", "again");
  EXPECT_EQ(poses(again), poses(after)) << "and can be extended as if nothing had been";
}

/// They returned it of the later version.
TEST_F(Versions, RevertedHasNothingThatRobotsReturned) {
  const HeldMap held = read_held(monday(), kMonday_ns).value();
  storage::MemoryStore store(storage::map_schema(), held.rows);
  Mapper({kCharlie}, store).walk({kCharlie, 0}, 5);
  name(store, kCharlie, "charlie");
  const storage::Write row{"meta", std::string(node::kReturnedPrefix) + "x", "y"};
  ASSERT_TRUE(store.commit(std::vector<storage::Write>{row}).has_value());
  ASSERT_TRUE(keep_extended(held, store, folder_ / "heard").has_value());
  EXPECT_EQ(test::rows_of(**open(folder_ / "heard"), node::kReturnedPrefix), 1U);
  ASSERT_TRUE(revert(folder_ / "heard", 1, folder_ / "reverted").has_value());
  EXPECT_EQ(test::rows_of(**open(folder_ / "reverted"), node::kReturnedPrefix), 0U);
}

TEST_F(Versions, ThatAreNotThereAreSaid) {
  const fs::path after = tuesday(monday());
  for (const std::uint64_t number : {0U, 2U, 7U}) {
    const auto reverted = revert(after, number, folder_ / "none");
    ASSERT_FALSE(reverted.has_value());
    EXPECT_NE(reverted.error().message.find("versions 1 to 2"), std::string::npos) << reverted.error().message;
  }
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(Versions, ADamagedRowIsSaid) {
  storage::MemoryStore store(storage::map_schema());
  for (const char* bytes : {"", "1234567", "12345678abcdefgh"}) {
    ASSERT_TRUE(store.commit(std::vector<storage::Write>{{"meta", "version/1", std::string(bytes)}}));
    const auto all = versions(store);
    ASSERT_FALSE(all.has_value()) << bytes;
    EXPECT_NE(all.error().message.find("version/1"), std::string::npos);
  }
}

}  // namespace versions_test
}  // namespace tutti::mapfile
