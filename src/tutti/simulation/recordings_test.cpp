// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/recordings.hpp"

#include <gtest/gtest.h>

#include "tutti/base/config_io.hpp"

namespace tutti::simulation {
namespace recordings_test {

SimulationConfig short_walks(std::size_t robots) {
  SimulationConfig config;
  config.robots.resize(robots);
  for (SimulatedRobotConfig& robot : config.robots) robot.walk.duration_s = 20.0;
  return config;
}

std::string problem_with(const SimulationConfig& config) {
  const auto world = simulate_recordings(config, {}, 1);
  return world ? "" : world.error().message;
}

TEST(SimulateRecordings, EveryRobotIsItsOwnAndDependsOnlyOnTheSeed) {
  const auto three = simulate_recordings(short_walks(3), {1000}, 9);
  ASSERT_TRUE(three.has_value());
  ASSERT_EQ(three->recordings.size(), 3U);
  EXPECT_EQ(three->recordings[2].name, "charlie");
  EXPECT_EQ(three->recordings[2].robot, RobotId{2});
  EXPECT_NE(three->recordings[0].reference, three->recordings[1].reference);
  const auto two = simulate_recordings(short_walks(2), {1000}, 9);
  for (std::size_t i = 0; i < 2; ++i) {  // another robot does not change the ones there
    EXPECT_EQ(two->recordings[i].reference, three->recordings[i].reference);
    EXPECT_EQ(two->recordings[i].odometry, three->recordings[i].odometry);
    EXPECT_EQ(two->recordings[i].odometry.size(), two->recordings[i].increment_covariance.size() + 1);
  }
}

TEST(SimulateRecordings, CopiesAreRobotsOfTheirOwn) {
  SimulationConfig config = short_walks(1);
  config.robots.front().copies = 3;
  config.robots.push_back({.name = "dog", .copies = 2, .start_s = 5.0, .walk = {.duration_s = 20.0}});
  const auto fleet = simulate_recordings(config, {1000}, 9);
  ASSERT_TRUE(fleet.has_value());
  std::vector<std::string> names;
  for (const Recording& recording : fleet->recordings) names.push_back(recording.name);
  EXPECT_EQ(names, (std::vector<std::string>{"alpha", "bravo", "charlie", "dog1", "dog2"}));
  const auto three = simulate_recordings(short_walks(3), {1000}, 9);  // the same as written out
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(fleet->recordings[i].odometry, three->recordings[i].odometry);
  EXPECT_NE(fleet->recordings[3].reference, fleet->recordings[4].reference);
  EXPECT_EQ(fleet->recordings[4].reference.front().stamp, Timestamp{1000} + 5.0);
  config.robots.back().name = "alpha";
  config.robots.back().copies = 1;
  EXPECT_EQ(problem_with(config), "simulation.robots.3: name 'alpha' is taken");
}

TEST(SimulateRecordings, StartsWhereAndWhenConfigured) {
  SimulationConfig config = short_walks(2);
  config.robots[1].start_s = 12.5;
  config.robots[1].start_junction = 7;
  const auto world = simulate_recordings(config, {1000}, 3);
  ASSERT_TRUE(world.has_value());
  const Recording& late = world->recordings[1];
  EXPECT_EQ(late.reference.front().stamp, Timestamp{1000} + 12.5);
  EXPECT_LT((late.reference.front().pose.translation - world->network.junctions[7]).norm(), 0.1);
}

TEST(SimulateRecordings, LidarSeesTheWallsOfOneSharedWorld) {
  SimulationConfig config = short_walks(2);
  config.sensors = "lidar";
  config.world.network = {.rows = 2, .columns = 2, .block_m = 15.0, .jitter_m = 1.0};
  config.lidar.rays_share = 0.13;
  const auto world = simulate_recordings(config, {}, 3);
  ASSERT_TRUE(world.has_value());
  ASSERT_TRUE(world->surface != nullptr);
  EXPECT_FALSE(world->surface->triangles.empty());
  for (const Recording& recording : world->recordings) {
    ASSERT_TRUE(recording.scans != nullptr);
    const auto scan = recording.scans->scan(80);
    ASSERT_TRUE(scan.has_value() && scan->has_value());
    EXPECT_EQ((*scan)->stamp, recording.odometry[80].stamp);
    EXPECT_GT((*scan)->cloud->points.size(), 500U);
  }
  config.sensors = "none";  // the sensor changes nothing else
  const auto blind = simulate_recordings(config, {}, 3);
  EXPECT_EQ(blind->surface, nullptr);
  EXPECT_EQ(blind->recordings[0].scans, nullptr);
  EXPECT_EQ(blind->recordings[1].odometry, world->recordings[1].odometry);
}

TEST(SimulateRecordings, WhatTheWorldHasNotIsAClearError) {
  SimulationConfig config = short_walks(2);
  EXPECT_EQ(problem_with(config), "");
  config.robots[1].start_junction = 20;  // of 4 x 5: 0 .. 19
  EXPECT_NE(problem_with(config).find("bravo"), std::string::npos);
  EXPECT_NE(problem_with(config).find("0 .. 19"), std::string::npos);
  config = short_walks(2);
  config.robots[0].walk.route = {0, 19};
  EXPECT_NE(problem_with(config).find("no corridor joins junctions 0 and 19"), std::string::npos);
  config = short_walks(2);
  config.robots[1].name = "alpha";
  EXPECT_NE(problem_with(config).find("taken"), std::string::npos);
  EXPECT_NE(problem_with(short_walks(0)).find("empty"), std::string::npos);
}

TEST(SimulateRecordings, SettingsThatCannotBeComputedAreRefused) {
  for (const std::string setting :
       {"robots: [{walk: {duration_s: .inf}}]", "robots: [{walk: {rate_hz: 1e9}}]", "robots: [{start_s: .inf}]",
        "robots: [{walk: {length_m: .inf}}]", "robots: [{walk: {lookahead_m: 0}}]",
        "robots: [{odometry: {slip_deg: .inf}}]", "world: {network: {block_m: 0.001}}", "world: {roof_length_m: .inf}",
        "surface: {width_m: .inf}", "surface: {body_height_m: .inf}", "lidar: {rays_share: .inf}"}) {
    const auto node = parse_yaml(setting, "simulation");
    ASSERT_TRUE(node.has_value()) << setting;
    SimulationConfig config;
    const Status ok = load_config(*node, config, "simulation");
    ASSERT_FALSE(ok.has_value()) << setting;
    EXPECT_NE(ok.error().message.find("must be in"), std::string::npos) << ok.error().message;
  }
  SimulationConfig config = short_walks(1);
  config.sensors = "lidar";
  config.world.network.rows = config.world.network.columns = 20;
  config.surface.cell_m = 0.05;
  EXPECT_NE(problem_with(config).find("surface.cell_m is 0.05"), std::string::npos) << problem_with(config);
}

}  // namespace recordings_test
}  // namespace tutti::simulation
