// SPDX-License-Identifier: BSD-3-Clause
// Robots that come late, go out of range, are alone, or never meet: an hour each, at trajectory level.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "tutti/lab/run_mission.hpp"

namespace tutti::mission {
namespace contact_test {

constexpr double kMinute_s = 60.0;

/// An hour in a small network; few samples and few updates, so that it takes seconds.
lab::MissionConfig an_hour(std::size_t robots) {
  lab::MissionConfig config;
  config.mission = "contact";
  config.source = "simulation";
  config.simulation.world.network = {
      .rows = 3, .columns = 3, .block_m = 20.0, .jitter_m = 3.0, .missing_share = 0.0, .max_slope = 0.03};
  config.simulation.robots.resize(robots);
  for (auto& robot : config.simulation.robots) {
    robot.walk.duration_s = 60.0 * kMinute_s;
    robot.walk.rate_hz = 2.0;
    robot.walk.min_speed_mps = 0.2;
    robot.walk.max_speed_mps = 0.4;
    robot.odometry.yaw_bias_deg_per_m = 0.03;
  }
  config.agent.submap.duration_s = 60.0;
  config.agent.submap.keyframe_time_s = 6.0;
  config.agent.submap.keyframe_distance_m = 1.5;
  config.server.update_least_s = 2.0 * kMinute_s;
  config.closure_changes.verifier = "reference";
  config.closure_changes.reference.wrong_share = 0.1;
  return config;
}

MissionRecord run(const lab::MissionConfig& config) {
  auto record = lab::run_mission(config, {.seed = 3, .threads = 1});
  EXPECT_TRUE(record.has_value()) << record.error().message;
  return record ? *record : MissionRecord{};
}

const Accuracy& corrected(const RobotRecord& robot) { return robot.policies.front().accuracy; }

void expect_as_good_as_the_server(const RobotRecord& robot) {
  EXPECT_LE(*corrected(robot).rmse_m, 1.1 * *robot.server.rmse_m + 0.02) << robot.name;
  EXPECT_LT(*corrected(robot).rmse_m, 0.5 * *robot.onboard.rmse_m) << robot.name;
}

TEST(Contact, ALoneRobotCorrectsItself) {
  const MissionRecord record = run(an_hour(1));
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_TRUE(record.transforms.empty());
  ASSERT_EQ(record.robots.size(), 1U);
  EXPECT_TRUE(record.robots[0].whereabouts.empty());
  expect_as_good_as_the_server(record.robots[0]);
}

TEST(Contact, ARobotThatJoinsAtMinuteFortyIsPartOfTheMap) {
  lab::MissionConfig config = an_hour(2);
  config.simulation.robots[1].start_s = 40.0 * kMinute_s;
  config.simulation.robots[1].walk.duration_s = 20.0 * kMinute_s;
  const MissionRecord record = run(config);
  EXPECT_EQ(record.server.components, 1U);
  ASSERT_EQ(record.robots.size(), 2U);
  const RobotRecord& late = record.robots[1];
  EXPECT_GT(record.robots[0].submaps, 50U);
  EXPECT_GT(late.submaps, 15U);
  ASSERT_FALSE(late.updates.empty());
  EXPECT_GE(late.updates.front().time_s, 40.0 * kMinute_s);
  EXPECT_EQ(late.whereabouts.size(), 1U);
  for (const RobotRecord& robot : record.robots) expect_as_good_as_the_server(robot);
}

TEST(Contact, TenMinutesOutOfRangeLoseNothing) {
  lab::MissionConfig config = an_hour(2);
  const MissionRecord always = run(config);
  RobotLinkConfig bravo{.robot = std::string("bravo"), .link = {}};
  bravo.link.outages = {{.from_s = 25.0 * kMinute_s, .until_s = 35.0 * kMinute_s}};
  config.robot_links = {bravo};
  const MissionRecord record = run(config);

  const RobotRecord& away = record.robots[1];
  EXPECT_EQ(away.submaps, always.robots[1].submaps);
  for (const UpdateRecord& update : away.updates)
    EXPECT_FALSE(update.time_s > 25.0 * kMinute_s + 1.0 && update.time_s < 35.0 * kMinute_s) << update.time_s;
  const auto heard = [](const RobotRecord& robot, double from_s, double until_s) {
    return std::ranges::count_if(robot.updates,
                                 [&](const UpdateRecord& u) { return u.time_s >= from_s && u.time_s < until_s; });
  };
  EXPECT_GE(heard(record.robots[0], 25.0 * kMinute_s, 35.0 * kMinute_s), 4);  // alpha goes on
  EXPECT_GE(heard(away, 35.0 * kMinute_s, 38.0 * kMinute_s), 1);
  ASSERT_EQ(record.server.graph.poses.size(), always.server.graph.poses.size());
  for (std::size_t i = 0; i < record.server.graph.poses.size(); ++i)
    EXPECT_LT((record.server.graph.poses[i].translation - always.server.graph.poses[i].translation).norm(), 1e-3);
  for (const RobotRecord& robot : record.robots) expect_as_good_as_the_server(robot);
}

TEST(Contact, AnOutageForEverEndsTheMissionAndIsNoted) {
  lab::MissionConfig config = an_hour(2);
  for (auto& robot : config.simulation.robots) robot.walk.duration_s = 10.0 * kMinute_s;
  // For ever, and until long after the end.
  for (const double until_s : {std::numeric_limits<double>::infinity(), 1e9}) {
    RobotLinkConfig bravo{.robot = std::string("bravo"), .link = {}};
    bravo.link.outages = {{.from_s = 0.0, .until_s = until_s}};
    config.robot_links = {bravo};
    const MissionRecord record = run(config);
    ASSERT_EQ(record.robots.size(), 2U);
    EXPECT_EQ(record.robots[1].submaps, 0U);
    EXPECT_TRUE(record.robots[1].updates.empty());
    EXPECT_GT(record.robots[0].submaps, 5U);
    const auto notes = [&](const std::string& what) {
      return std::ranges::count_if(record.notes, [&](const auto& n) { return n.find(what) != std::string::npos; });
    };
    EXPECT_EQ(notes("bravo to server: "), 1);
    EXPECT_EQ(notes("server to bravo: 1 x proxy graph never delivered"), 1);
    EXPECT_EQ(notes("alpha"), 0);
  }
}

TEST(Contact, ALinkOfAnUnknownRobotIsAnError) {
  lab::MissionConfig config = an_hour(1);
  config.robot_links = {{.robot = std::string("zulu"), .link = {}}};
  const auto record = lab::run_mission(config, {.seed = 3, .threads = 1});
  ASSERT_FALSE(record.has_value());
  EXPECT_NE(record.error().message.find("zulu"), std::string::npos) << record.error().message;
}

TEST(Contact, RobotsThatNeverMeetKeepTwoGoodMaps) {
  lab::MissionConfig config = an_hour(2);
  config.simulation.world.network.columns = 6;
  // Each keeps to its own end of the network.
  config.simulation.robots[0].walk.route = {0, 1, 7, 6};
  config.simulation.robots[1].walk.route = {4, 5, 11, 10};
  config.closure_changes.reference.wrong_share = 0.0;
  const MissionRecord record = run(config);
  EXPECT_EQ(record.server.components, 2U);
  EXPECT_TRUE(record.transforms.empty());
  ASSERT_EQ(record.robots.size(), 2U);
  for (const RobotRecord& robot : record.robots) {
    EXPECT_TRUE(robot.whereabouts.empty());
    expect_as_good_as_the_server(robot);
  }
}

}  // namespace contact_test
}  // namespace tutti::mission
