// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "support/paths.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/lab/write_bags.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::lab {
namespace ranges_mission_test {

/// Missions/ranges.yaml with one map at its end.
mission::MissionRecord run(std::uint64_t seed, const std::vector<std::string>& assignments) {
  std::vector<std::string> all{"server.update_least_s=600"};
  all.insert(all.end(), assignments.begin(), assignments.end());
  const auto config = load_mission(test::source_path("missions/ranges.yaml"), all);
  EXPECT_TRUE(config) << config.error().message;
  auto record = run_mission(*config, {.seed = seed, .threads = 1});
  EXPECT_TRUE(record) << record.error().message;
  return std::move(*record);
}

/// The whole path of a range: radio, robot, message, server, report.
TEST(RangesMission, RangesMakeTheMapBetter) {
  const auto without = run(1, {"server.map.use_ranges=false"}), with = run(1, {});
  EXPECT_EQ(with.server.components, 1U);
  EXPECT_LT(*with.server.joint.rmse_m, 0.9 * *without.server.joint.rmse_m);
  const auto is_of_ranges = [](const std::string& note) { return note.find("ranges count") != std::string::npos; };
  EXPECT_EQ(std::ranges::count_if(with.notes, is_of_ranges), 6);
  EXPECT_EQ(std::ranges::count_if(without.notes, is_of_ranges), 0);
}

TEST(RangesMission, WrongRadiosDoNoHarmAndAreSaid) {
  const auto without = run(1, {"server.map.use_ranges=false"});
  for (const char* const wrong : {"ranging.clock_offset_s=2", "ranging.bias_m=2"}) {
    const auto with = run(1, {wrong});
    EXPECT_EQ(*with.server.joint.rmse_m, *without.server.joint.rmse_m) << wrong;
    const auto is_of_none = [](const std::string& note) {
      return note.find("ranges count; none of") != std::string::npos;
    };
    EXPECT_EQ(std::ranges::count_if(with.notes, is_of_none), 6) << wrong;
  }
}

/// As many of the same, to whom their topics say.
TEST(RangesMission, BagsHaveThem) {
  std::vector<std::string> brief{"ranging.every_s=1", "ranging.reach_m=200"};
  for (int robot = 0; robot < 2; ++robot)
    for (const char* const setting : {"duration_s=40", "length_m=20"})
      brief.push_back(fmt::format("simulation.robots.{}.walk.{}", robot, setting));
  const auto config = load_mission(test::source_path("missions/tunnel.yaml"), brief);
  ASSERT_TRUE(config) << config.error().message;
  const auto simulated = load_input(*config, {}, 1);
  ASSERT_TRUE(simulated) << simulated.error().message;
  const auto folder = std::filesystem::path(::testing::TempDir()) / fmt::format("ranges_mission_{}", getpid());
  const auto written = write_bags(*config, 1, folder.string());
  ASSERT_TRUE(written) << written.error().message;
  mission::MissionConfig of_bags;
  for (const WrittenBag& bag : *written)
    of_bags.robots.push_back({.name = std::filesystem::path(bag.folder).filename().string(), .bag = bag.folder});
  const auto read = mission::load_input(of_bags, {}, 1, {});
  ASSERT_TRUE(read) << read.error().message;
  std::size_t all = 0;
  for (std::size_t r = 0; r < 2; ++r) {
    const auto in = measured<RobotRange>(simulated->robots[r].recording),
               out = measured<RobotRange>(read->robots[r].recording);
    ASSERT_EQ(in.size(), out.size());
    const Timestamp begin = simulated->robots[r].recording.odometry.front().stamp,
                    begin_of_bag = read->robots[r].recording.odometry.front().stamp;
    for (std::size_t i = 0; i < in.size(); ++i, ++all) {
      EXPECT_EQ(out[i].to, in[i].to);
      EXPECT_EQ(out[i].stamp - begin_of_bag, in[i].stamp - begin);
      EXPECT_NEAR(out[i].distance_m, in[i].distance_m, 1e-5);
      EXPECT_NEAR(out[i].sigma_m, in[i].sigma_m, 1e-6);
      EXPECT_LT((out[i].p_body_antenna - in[i].p_body_antenna).norm(), 1e-9);
    }
  }
  EXPECT_GT(all, 50U);
  std::filesystem::remove_all(folder);
}

}  // namespace ranges_mission_test
}  // namespace tutti::lab
