// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/disk_cloud_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/server/map_server.hpp"

namespace {

/// What was made safe on disk: its path then and, of a file, how many bytes it had.
thread_local std::vector<std::pair<std::filesystem::path, std::uintmax_t>> synced;
thread_local int refuse_with = 0;  // errno

}  // namespace

extern "C" int fsync(int file) {  // instead of the C library's: no test waits for a disk
  const std::filesystem::path path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file));
  synced.emplace_back(path, std::filesystem::is_directory(path) ? 0 : std::filesystem::file_size(path));
  errno = refuse_with;
  return refuse_with == 0 ? 0 : -1;
}

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

constexpr SubmapId kId{RobotId{3}, 17};

std::shared_ptr<const PointCloud> some_cloud(std::uint64_t seed, std::size_t points = 50) {
  Rng rng(seed);
  auto cloud = std::make_shared<PointCloud>();
  for (std::size_t i = 0; i < points; ++i)
    cloud->points.emplace_back(rng.uniform(-40, 40), rng.uniform(-40, 40), rng.uniform(-2, 4));
  return cloud;
}

class DiskCloudStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ::testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::shared_ptr<DiskCloudStore> open() const {
    auto store = DiskCloudStore::open(folder_, {});
    EXPECT_TRUE(store.has_value()) << store.error().message;
    return *store;
  }
  fs::path folder_;
};

TEST_F(DiskCloudStoreTest, GivesBackTheSamePointsAlsoFromAnotherProcessesFiles) {
  const auto cloud = *wire::decode_cloud(wire::encode(*some_cloud(1)));  // as it comes from a robot
  const auto store = open();
  ASSERT_TRUE(store->put(kId, cloud).has_value());
  EXPECT_EQ(**store->get(kId), *cloud);
  EXPECT_EQ(**open()->get(kId), *cloud);
  ASSERT_TRUE(store->put(kId, some_cloud(2)).has_value());
  EXPECT_NE(**store->get(kId), *cloud);
  EXPECT_EQ(**store->get(kId), **open()->get(kId));  // rounded in the same way
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(DiskCloudStoreTest, KeepsTheSessionsOfARobotApart) {
  const std::vector<SubmapId> ids{{RobotId{1}, 23}, {{RobotId{1}, 2}, 3}, {{RobotId{1}, 23}, 0}, {RobotId{12}, 3}};
  const auto store = open();
  for (std::size_t i = 0; i < ids.size(); ++i) ASSERT_TRUE(store->put(ids[i], some_cloud(i, i + 1)).has_value());
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ((*open()->get(ids[i]))->points.size(), i + 1);
}

TEST_F(DiskCloudStoreTest, MissingTruncatedAndForeignFilesAreErrorsThatNameTheSubmap) {
  const auto store = open();
  const auto complains = [&] {
    const auto cloud = store->get(kId);
    return !cloud && cloud.error().message.find("submap 3/17") != std::string::npos;
  };
  EXPECT_TRUE(complains());
  ASSERT_TRUE(store->put(kId, some_cloud(1)).has_value());
  EXPECT_FALSE(complains());
  const fs::path file = fs::directory_iterator(folder_)->path();
  fs::resize_file(file, fs::file_size(file) - 1);
  EXPECT_TRUE(complains());
  std::ofstream(file, std::ios::trunc) << "something else";
  EXPECT_TRUE(complains());
  ASSERT_TRUE(store->put(kId, some_cloud(1)).has_value());
  EXPECT_FALSE(complains());
}

TEST_F(DiskCloudStoreTest, WhatCannotBeWrittenIsRefused) {
  const auto store = open();
  auto far = std::make_shared<PointCloud>(PointCloud{{{1e6F, 0.0F, 0.0F}}});
  EXPECT_FALSE(store->put(kId, far).has_value());
  fs::remove_all(folder_);
  EXPECT_FALSE(store->put(kId, some_cloud(1)).has_value());
  EXPECT_FALSE(store->get(kId).has_value());
  std::ofstream(folder_) << "a file where the folder should be";
  EXPECT_FALSE(DiskCloudStore::open(folder_, {}).has_value());
}

TEST_F(DiskCloudStoreTest, ACloudIsOnTheDiskBeforeItHasItsNameAndSoIsItsName) {
  const auto store = open();
  synced.clear();
  ASSERT_TRUE(store->put(kId, some_cloud(1)).has_value());
  const fs::path file = fs::directory_iterator(folder_)->path();
  ASSERT_EQ(synced.size(), 2U);
  EXPECT_EQ(synced[0].first.filename(), file.filename().string() + ".part");
  EXPECT_EQ(synced[0].second, fs::file_size(file));  // all of it
  EXPECT_EQ(synced[1].first, fs::canonical(folder_));

  refuse_with = EIO;
  const Status failed = store->put(kId, some_cloud(2));
  refuse_with = EINVAL;  // there are file systems that cannot
  const Status unknown = store->put(kId, some_cloud(2));
  refuse_with = 0;
  ASSERT_FALSE(failed.has_value());
  EXPECT_NE(failed.error().message.find("3_17.cloud.part"), std::string::npos) << failed.error().message;
  EXPECT_TRUE(unknown.has_value());
}

TEST_F(DiskCloudStoreTest, SeveralThreadsAtOnce) {
  const auto store = open();
  for (std::uint32_t i = 0; i < 8; ++i) ASSERT_TRUE(store->put({RobotId{0}, i}, some_cloud(i, i + 1)).has_value());
  std::vector<std::size_t> wrong(4, 0);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < wrong.size(); ++t)
      threads.emplace_back([&, t] {
        Rng rng(t);
        for (int k = 0; k < 200; ++k) {
          const auto i = static_cast<std::uint32_t>(rng.index(8));
          const auto cloud = store->get({RobotId{0}, i});
          wrong[t] += !cloud || (*cloud)->points.size() != i + 1 ? 1 : 0;
        }
      });
  }
  EXPECT_EQ(wrong, std::vector<std::size_t>(4, 0));
}

/// Looks at each cloud once, as a finder does that keeps features, and only at pairs of neighbours.
class NeighbourFinder final : public server::ClosureFinder {
 public:
  [[nodiscard]] std::uint32_t version() const override { return 1; }
  [[nodiscard]] bool needs_clouds() const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return second.id.index - first.id.index == 1;
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::CloudStore& clouds) const override {
    const auto cloud = clouds.get(first.id);
    if (!cloud) return tl::unexpected(cloud.error());
    return ClosureVerdict{{first.id, second.id}, {}, Refusal{RefusalReason::no_alignment}, version()};
  }
};

SubmapMessage submap_with_cloud(std::uint32_t index) {
  Submap submap{.id = {RobotId{0}, index}};
  submap.keyframes = {{index, {1'000'000'000LL * (index + 1)}, {}, true},
                      {index + 1, {1'000'000'000LL * (index + 2)}, {}, true}};
  submap.odometry = {RelativePose{}};
  submap.cloud = some_cloud(index, 20);
  return {.header = {.robot = RobotId{0}}, .submap = std::move(submap)};
}

TEST_F(DiskCloudStoreTest, AServerOf700SubmapsHoldsNoCloudAndGoesOnAfterARestart) {
  constexpr std::uint32_t kSubmaps = 700;
  const auto finder = std::make_shared<const NeighbourFinder>();
  const auto store = open();
  const std::set<RobotId> robots{RobotId{0}};
  auto server = std::make_unique<server::MapServer>(robots, finder, store, server::ServerConfig{}, 1);
  std::vector<std::weak_ptr<const PointCloud>> all;
  std::size_t most = 0;
  for (std::uint32_t i = 0; i < kSubmaps; ++i) {
    {
      const SubmapMessage message = submap_with_cloud(i);
      ASSERT_TRUE(server->receive(message).has_value());
      all.emplace_back(message.submap.cloud);
    }
    all.emplace_back(*store->get({RobotId{0}, i}));
    all.emplace_back(*store->get({RobotId{0}, i / 2}));
    const auto jobs = i < kSubmaps / 2 ? server->take_jobs() : std::vector<server::VerificationJob>();
    for (const auto& job : jobs) {
      ASSERT_TRUE(server->receive(*finder->verify(*job.first, *job.second, *store)).has_value());
    }
    const auto alive = std::ranges::count_if(all, [](const auto& cloud) { return !cloud.expired(); });
    most = std::max(most, static_cast<std::size_t>(alive));
  }
  EXPECT_EQ(most, 0U);
  EXPECT_EQ(server->state().cloud_sizes.size(), kSubmaps);

  // Killed with half of the verdicts outstanding, and one cloud lost.
  const server::MapServerState state = server->state();
  server.reset();
  fs::remove(folder_ / "0_500.cloud");
  const auto reopened = open();
  server::MapServer restored(robots, finder, reopened, {}, 2, state);
  std::size_t unanswered = 0;
  for (const auto& job : restored.take_jobs()) {
    const auto verdict = finder->verify(*job.first, *job.second, *reopened);
    unanswered += verdict ? 0 : 1;
    if (!verdict) continue;
    EXPECT_TRUE(restored.receive(*verdict).has_value());
  }
  EXPECT_EQ(unanswered, 1U);
  EXPECT_EQ(restored.refusals().at(RefusalReason::no_alignment).intra, kSubmaps - 2U);
  EXPECT_EQ(restored.state().submaps.size(), kSubmaps);
}

TEST_F(DiskCloudStoreTest, AMissionNotesAnUnreadablePairOnceHoweverOftenItIsTried) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.world.network = {.rows = 2, .columns = 2, .block_m = 12.0, .jitter_m = 0.0, .missing_share = 0.0};
  config.simulation.robots.resize(1);
  config.simulation.robots[0].walk.duration_s = 20.0;
  config.simulation.lidar.azimuth_step_deg = 3.0;
  config.agent.submap.duration_s = 2.0;
  config.server.update_period_s = 1.0;
  config.closures.finder = "lidar";
  config.closures.min_submap_gap = 7;  // when the first pair is asked for, the first cloud lies on disk only
  const auto lose_the_first = [&](const Progress& progress) {
    if (progress.submaps > 5) fs::remove(folder_ / "0_0.cloud");
  };
  const auto record = run_mission(config, {.clouds = folder_, .threads = 1, .progress = lose_the_first});
  ASSERT_TRUE(record.has_value()) << record.error().message;
  ASSERT_EQ(record->robots[0].submaps, 10U);  // pairs of submap 0 with 7, 8 and 9 are tried 3, 2 and 1 times
  ASSERT_FALSE(record->notes.empty());
  EXPECT_NE(record->notes[0].find("3 messages were refused"), std::string::npos) << record->notes[0];
  EXPECT_NE(record->notes[0].find("cloud of submap 0/0"), std::string::npos) << record->notes[0];
}

}  // namespace
}  // namespace tutti::mission
