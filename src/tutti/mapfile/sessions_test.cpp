// SPDX-License-Identifier: BSD-3-Clause
// Tomorrow's robots join yesterday's map.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "support/mapfile/small_map.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {
namespace sessions_test {

using test::Mapper;

const RobotId kAlpha{0}, kBravo{1}, kCharlie{2};
const ChainId kYesterday[] = {{kAlpha, 100}, {kBravo, 100}};
const ChainId kToday[] = {{kAlpha, 200}, {kCharlie, 200}};

bool is_yesterday(const ChainId& chain) { return chain.session == 100; }

struct Day {
  std::map<SubmapPair, ClosureVerdict> verdicts;
  std::map<KeyframeId, Pose3> poses;
  std::uint64_t epoch = 0, revision = 0;
};

Day day_of(const Mapper& mapper) {
  Day day{.epoch = mapper.server().state().epoch, .revision = mapper.server().state().revision};
  for (const auto& [pair, verdict] : mapper.server().state().verdicts)
    if (is_yesterday(pair.first.chain) && is_yesterday(pair.second.chain)) day.verdicts[pair] = verdict;
  for (const MapNode& node : mapper.server().map().nodes)
    if (is_yesterday(node.id.chain)) day.poses[node.id] = node.T_world_body;
  return day;
}

/// Root mean square of positions against the truth, after one alignment.
double error_of(const Day& day) {
  std::vector<Eigen::Vector3d> truth, estimate;
  for (const auto& [id, pose] : day.poses) {
    truth.push_back(server::test::true_pose(id.chain.robot, id.index).translation);
    estimate.push_back(pose.translation);
  }
  const Pose3 T = align_points(truth, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (truth[i] - T * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

/// One day's robots on a store that another process had yesterday.
template <class Reopen>
void expect_days_to_join(Reopen&& reopen) {
  Day yesterday;
  std::map<std::string, std::string> rows;
  {
    auto store = reopen();
    Mapper mapper({kAlpha, kBravo}, *store);
    for (const ChainId& chain : kYesterday) mapper.walk(chain);
    yesterday = day_of(mapper);
    EXPECT_EQ(mapper.server().map().components, 1U);
    ASSERT_TRUE(
        store->scan("submaps", {}, [&](auto key, auto bytes) { return rows.emplace(key, bytes), true; }).has_value());
  }
  auto store = reopen();
  Mapper mapper({kAlpha, kBravo, kCharlie}, *store, 5000);
  mapper.update();
  EXPECT_EQ(day_of(mapper).poses, yesterday.poses);  // the map of before, before anybody has come
  for (const ChainId& chain : kToday) mapper.walk(chain);
  const Day today = day_of(mapper);
  EXPECT_EQ(today.verdicts, yesterday.verdicts);
  EXPECT_EQ(today.epoch, yesterday.epoch);
  EXPECT_GT(today.revision, yesterday.revision);
  for (const auto& [key, bytes] : rows) EXPECT_EQ(store->read("submaps", key).value(), bytes);
  EXPECT_EQ(mapper.server().map().components, 1U);
  std::size_t between = 0;
  for (const auto& judged : mapper.server().map().closures)
    between += judged.accepted && is_yesterday(judged.closure.from.chain) != is_yesterday(judged.closure.to.chain);
  EXPECT_GT(between, 10U);
  ASSERT_EQ(today.poses.size(), yesterday.poses.size());
  EXPECT_LT(error_of(today), 1.05 * error_of(yesterday));
  // Nothing but new closures moves yesterday's part.
  server::VerdictSet old(yesterday.verdicts.begin(), yesterday.verdicts.end());
  for (const MapNode& node : server::estimate_map(mapper.server().state().submaps, old, {}).nodes)
    if (is_yesterday(node.id.chain)) {
      EXPECT_LT(local(node.T_world_body, yesterday.poses.at(node.id)).norm(), 1e-5) << node.id.index;
    }
}

TEST(Sessions, OfTwoDaysJoinInMemory) {
  storage::MemoryStore store(storage::map_schema());
  expect_days_to_join([&] { return &store; });
}

TEST(Sessions, OfTwoDaysJoinInAFile) {
  const auto file = std::filesystem::path(testing::TempDir()) / ("sessions_" + std::to_string(getpid()));
  std::filesystem::remove(file);
  expect_days_to_join(
      [&] { return storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0}).value(); });
  std::filesystem::remove(file);
}

}  // namespace sessions_test
}  // namespace tutti::mapfile
