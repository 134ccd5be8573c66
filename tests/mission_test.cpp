// SPDX-License-Identifier: BSD-3-Clause
// Whole missions, small, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "support/paths.hpp"
#include "support/sanitized.hpp"
#include "support/server/optimum.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/view_recorder.hpp"

namespace tutti::mission {
namespace mission_test {

lab::MissionConfig small_mission() {
  lab::MissionConfig config;
  config.mission = "small";
  config.source = "simulation";
  config.simulation.world.network = {.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 2.0, .missing_share = 0.0};
  for (simulation::SimulatedRobotConfig& robot : config.simulation.robots) {
    robot.walk.duration_s = 200.0;
    robot.odometry.yaw_bias_deg_per_m = 0.05;
  }
  config.closure_changes.verifier = "reference";
  config.closure_changes.reference.min_time_gap_s = 20.0;
  return config;
}

MissionRecord run(const lab::MissionConfig& config, std::uint64_t seed = 1, int threads = 1) {
  auto record = lab::run_mission(config, {.seed = seed, .threads = threads, .updated = server::test::expect_optimum});
  EXPECT_TRUE(record.has_value()) << record.error().message;
  return record ? *record : MissionRecord{};
}

const PolicyRecord& policy(const RobotRecord& robot, const std::string& name) {
  const auto found =
      std::find_if(robot.policies.begin(), robot.policies.end(), [&](const PolicyRecord& p) { return p.name == name; });
  EXPECT_NE(found, robot.policies.end()) << name;
  return *found;
}

TEST(Mission, ARobotDoesTheSameWithItsOwnPartOfTheMap) {
  TUTTI_SAME_CODE();
  lab::MissionConfig config = small_mission();
  config.compare_policies = {"spectral"};
  ASSERT_EQ(config.server.broadcast, "own");
  const MissionRecord own = run(config);
  config.server.broadcast = "all";
  const MissionRecord all = run(config);
  ASSERT_EQ(own.robots.size(), 2U);
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_LT(own.robots[r].bytes_down, 6 * all.robots[r].bytes_down / 10) << own.robots[r].name;
    ASSERT_EQ(own.robots[r].policies.size(), 2U);
    for (std::size_t p = 0; p < 2; ++p)
      EXPECT_EQ(own.robots[r].policies[p].corrected, all.robots[r].policies[p].corrected);
    ASSERT_EQ(own.robots[r].whereabouts.size(), 1U);
    EXPECT_EQ(own.robots[r].whereabouts[0].T_map_body, all.robots[r].whereabouts.at(0).T_map_body);
  }
  EXPECT_EQ(own.server.proxy, all.server.proxy);
}

TEST(Mission, ClosesTheLoop) {
  lab::MissionConfig config = small_mission();
  config.compare_policies = {"spectral", "uniform"};
  const MissionRecord record = run(config);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_GT(record.server.closures.size(), 10U);
  ASSERT_TRUE(record.server.closure_check.has_value());
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  ASSERT_EQ(record.robots.size(), 2U);
  for (const RobotRecord& robot : record.robots) {
    const PolicyRecord& corrected = policy(robot, record.default_policy);
    ASSERT_TRUE(robot.onboard.rmse_m && robot.server.rmse_m && corrected.accuracy.rmse_m);
    EXPECT_LT(*robot.server.rmse_m, 0.5 * *robot.onboard.rmse_m);
    EXPECT_LT(*corrected.accuracy.rmse_m, 1.1 * *robot.server.rmse_m + 0.02);
    EXPECT_LE(*corrected.accuracy.rpe_m, *robot.onboard.rpe_m * 1.02);
    EXPECT_GT(robot.bytes_up, 0U);
    EXPECT_GT(robot.bytes_down, 0U);
    EXPECT_GE(robot.updates.size(), static_cast<std::size_t>(record.duration_s / 20.0));  // one every 20 s at least
    EXPECT_EQ(robot.whereabouts.size(), 1U);
    EXPECT_EQ(policy(robot, "uniform").constraints_added, policy(robot, "spectral").constraints_added);
  }
}

TEST(Mission, AMapAmongWrongClosuresIsAsGoodAsAPerfectJudges) {
  TUTTI_SAME_CODE();
  lab::MissionConfig config = small_mission();
  config.closure_changes.reference.wrong_share = 0.2;
  const MissionRecord record = run(config);
  for (const RobotRecord& robot : record.robots) {
    ASSERT_TRUE(robot.perfect && robot.perfect->rmse_m);
    EXPECT_LT(*robot.server.rmse_m, 1.2 * *robot.perfect->rmse_m + 0.005) << robot.name;
    EXPECT_LT(*robot.perfect->rmse_m, 0.5 * *robot.onboard.rmse_m) << robot.name;
  }
}

TEST(Mission, TheReportDependsOnTheSeedAndNotOnTheThreads) {
  const lab::MissionConfig config = small_mission();
  const std::string one = report_json(run(config, 3, 1));
  EXPECT_EQ(one, report_json(run(config, 3, 4)));
  EXPECT_NE(one, report_json(run(config, 4, 1)));
}

TEST(Mission, ABadLinkDelaysTheMapAndTheRobotsAndHarmsNeither) {
  lab::MissionConfig config = small_mission();
  const MissionRecord good = run(config);
  config.link.latency_s = 1.0;
  config.link.jitter_s = 30.0;  // submaps overtake each other, and broadcasts
  config.link.loss = 0.2;
  config.link.duplicate = 0.3;
  config.link.outages = {{.from_s = 100.0, .until_s = 160.0}};
  const MissionRecord bad = run(config);
  EXPECT_EQ(bad.server.components, 1U);
  ASSERT_EQ(bad.server.graph.poses.size(), good.server.graph.poses.size());
  for (std::size_t i = 0; i < bad.server.graph.poses.size(); ++i)
    EXPECT_LT((bad.server.graph.poses[i].translation - good.server.graph.poses[i].translation).norm(), 1e-3);
  for (std::size_t r = 0; r < bad.robots.size(); ++r) {
    const RobotRecord& robot = bad.robots[r];
    EXPECT_LT(robot.updates.size(), good.robots[r].updates.size());  // lost, or overtaken by a newer one
    ASSERT_FALSE(robot.updates.empty());
    EXPECT_GE(robot.updates.back().revision + 1, bad.server.proxy.revision);  // the very last may come too late
    for (std::size_t u = 1; u < robot.updates.size(); ++u)
      EXPECT_GT(robot.updates[u].revision, robot.updates[u - 1].revision);
    for (const UpdateRecord& update : robot.updates)  // what was sent before the outage may arrive within it
      EXPECT_FALSE(update.time_s > 100.0 + 1.0 + 30.0 && update.time_s < 160.0) << update.time_s;
    const Accuracy& corrected = policy(robot, bad.default_policy).accuracy;
    EXPECT_LT(*corrected.rmse_m, 1.05 * *robot.server.rmse_m + 0.01) << robot.name;  // measured: 1.02 times
    EXPECT_LT(*corrected.rmse_m, 0.5 * *robot.onboard.rmse_m) << robot.name;
    EXPECT_LE(*corrected.rpe_m, *robot.onboard.rpe_m) << robot.name;
  }
}

/// As somebody would have seen it at the page: the report's page has robots' statuses, and what they make alarm.
TEST(Mission, TheReportShowsARobotThatWasOutOfRange) {
  lab::MissionConfig config = small_mission();
  config.server.update_least_s = 5.0;
  config.robot_links = {{.robot = "bravo", .link = {.outages = {{.from_s = 60.0, .until_s = 120.0}}}}};
  const MissionRecord record = run(config);
  ASSERT_NE(record.view, nullptr);
  std::vector<double> silent_s, alarmed_s;
  std::size_t statuses = 0;
  for (const page::Message& message : record.view->messages) {
    const auto value = nlohmann::json::parse(message.value);
    if (message.key == "status") {
      ++statuses;
      ASSERT_EQ(value.at("robots").size(), 2U);
      EXPECT_EQ(value.at("robots").at(1).at("name"), "bravo");
      EXPECT_EQ(value.at("robots").at(0).at("last_seen_s_ago"), 0.0);
      if (value.at("robots").at(1).at("last_seen_s_ago").get<double>() > 10.0) silent_s.push_back(message.time_s);
    }
    if (message.key == "alerts")
      for (const auto& alert : value)
        if (alert.at("what") == "silent") {
          alarmed_s.push_back(message.time_s);
          EXPECT_EQ(alert.at("where"), "bravo");
          EXPECT_DOUBLE_EQ(alert.at("since_s").get<double>(), 60.0);
        }
  }
  EXPECT_GT(statuses, 15U);
  ASSERT_FALSE(silent_s.empty());
  EXPECT_GT(silent_s.front(), 70.0);
  EXPECT_LT(silent_s.back(), 120.0);
  EXPECT_FALSE(alarmed_s.empty());
}

TEST(Mission, RobotsThatNeverMeetStaySeparateMaps) {
  lab::MissionConfig config = small_mission();
  config.closure_changes.reference.radius_m = 0.001;
  config.closure_changes.reference.wrong_share = 0.0;
  const MissionRecord record = run(config);
  EXPECT_EQ(record.server.components, 2U);
  EXPECT_TRUE(record.transforms.empty());
  for (const RobotRecord& robot : record.robots) {
    EXPECT_TRUE(robot.whereabouts.empty());
    EXPECT_NEAR(*policy(robot, record.default_policy).accuracy.rmse_m, *robot.onboard.rmse_m, 1e-3);
  }
}

TEST(Mission, ALoneRobotIsAMissionToo) {
  lab::MissionConfig config = small_mission();
  config.simulation.robots.resize(1);
  const MissionRecord record = run(config);
  EXPECT_EQ(record.server.components, 1U);
  ASSERT_EQ(record.robots.size(), 1U);
  const RobotRecord& robot = record.robots[0];
  ASSERT_EQ(robot.policies.size(), 1U) << "others run only where a mission asks for them";
  EXPECT_EQ(robot.policies[0].name, record.default_policy);
  EXPECT_LT(*robot.policies[0].accuracy.rmse_m, 0.6 * *robot.onboard.rmse_m);
}

TEST(Mission, TheReportNamesTheSegmentWhereOdometryFailed) {
  const auto config = lab::load_mission(test::source_path("missions/terrace.yaml"),
                                        {"simulation.sensors=none", "closures.verifier=reference"});
  ASSERT_TRUE(config.has_value()) << config.error().message;
  const MissionRecord record = run(*config);
  const RobotRecord& alpha = record.robots[0];
  const auto origin = std::ranges::find(alpha.drift_origins, DriftOrigin::Kind::failure, &DriftOrigin::kind);
  ASSERT_NE(origin, alpha.drift_origins.end());
  ASSERT_EQ(record.server.failed_odometry.size(), 1U);
  const FailedOdometryRecord& failed = record.server.failed_odometry.front();
  EXPECT_EQ(failed.robot, alpha.id);
  EXPECT_LT(failed.from, origin->until);
  EXPECT_GT(failed.until, origin->from);
  EXPECT_GT(failed.error_m, 0.3);
}

TEST(Mission, AMissingFileIsAClearError) {
  lab::MissionConfig config = small_mission();
  config.source = "recordings";
  config.robots = {{.name = "alpha", .odometry = {.file = "nowhere/odometry.tum"}}};
  const auto record = lab::run_mission(config, {.data = "data"});
  ASSERT_FALSE(record.has_value());
  EXPECT_NE(record.error().message.find("alpha"), std::string::npos) << record.error().message;
  EXPECT_NE(record.error().message.find("nowhere/odometry.tum"), std::string::npos) << record.error().message;
}

}  // namespace mission_test
}  // namespace tutti::mission
