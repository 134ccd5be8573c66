// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "support/mission/report/report_example.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::mission {
namespace json_test {

using nlohmann::json;

std::set<std::string> keys(const json& object) {
  std::set<std::string> out;
  for (const auto& [key, value] : object.items()) out.insert(key);
  return out;
}

void expect_keys(const json& object, const std::vector<std::string>& wanted) {
  const auto have = keys(object);
  for (const auto& key : wanted) EXPECT_TRUE(have.contains(key)) << "missing " << key << " in " << object.dump();
}

TEST(ReportJson, HasTheDocumentedKeys) {
  const json report = json::parse(report_json(test::example_record()));
  EXPECT_EQ(report["format"], 3);
  expect_keys(report, {"mission", "seed", "default_policy", "robots", "server", "transforms", "input", "notes",
                       "association", "rpe_interval", "duration_s", "description"});
  ASSERT_EQ(report["robots"].size(), 2U);
  for (const auto& robot : report["robots"]) {
    expect_keys(robot, {"name", "distance_m", "odometry_factors", "rotation_variance_factor", "onboard_rmse_m",
                        "server_rmse_m", "policies", "bytes_up", "bytes_down", "traffic", "proxy_nodes", "images"});
    ASSERT_EQ(robot["traffic"].size(), 2U);
    for (const auto& row : robot["traffic"])
      expect_keys(row,
                  {"from", "to", "kind", "messages", "bytes", "transmitted_bytes", "bytes_per_s", "largest_message"});
    EXPECT_EQ(robot["traffic"][1]["largest_message"], 9876);
    ASSERT_EQ(robot["policies"].size(), 6U);
    for (const auto& policy : robot["policies"])
      EXPECT_EQ(keys(policy),
                (std::set<std::string>{"rmse_m", "max_error_m", "rpe_m", "rpe_deg", "rpe_10m_m", "rpe_10m_deg",
                                       "discontinuity_m", "discontinuity_deg", "agreement_rmse_m", "constraints",
                                       "scored_share", "partial", "agreement_scored_share", "agreement_partial"}));
  }
  expect_keys(report["server"], {"components", "closures_accepted", "closures_rejected", "rmse_m"});
  for (const auto& transform : report["transforms"])
    expect_keys(transform, {"from", "to", "translation_m", "quaternion_xyzw"});
}

TEST(ReportJson, SaysWhatTheAdjustmentMadeOfTheMap) {
  MissionRecord record = test::example_record();
  EXPECT_TRUE(json::parse(report_json(record))["server"]["refinement"].is_null());
  record.server.refinement = RefinementCounts{152, 7417, 26486, 811, 1204, 93, 12, 377, 41, 2.5, 1.125};
  record.server.updates = {
      {.time_s = 40.0, .closures = 4, .cost = 7.25, .degrees_of_freedom = 24, .from_measurements = true}};
  record.timing.server_refinements = {{false, 2, 5, 0.25}};
  record.timing.server_work = {31, 27730, 36, 33, 230, 2303424, 190};
  const json refinement = json::parse(report_json(record))["server"]["refinement"];
  EXPECT_EQ(refinement["joined_by_keyframe"], 811);
  EXPECT_EQ(refinement["two_positions"], 93);
  EXPECT_EQ(refinement["rms_after_px"], 1.125);
  EXPECT_EQ(json::parse(timing_json(record))["server"]["refinements"][0]["submaps"], 5);
  EXPECT_EQ(json::parse(timing_json(record))["server"]["costliest_update"], (json{{"time_s", 40.0},
                                                                                  {"took_ms", 64.0},
                                                                                  {"cpu_ms", 51.0},
                                                                                  {"cost", 7.25},
                                                                                  {"degrees_of_freedom", 24},
                                                                                  {"start", "measurements"}}));
  EXPECT_EQ(json::parse(timing_json(record))["server"]["optimisation_cpu"]["max_ms"], 51.0);
  EXPECT_TRUE(json::parse(timing_json(MissionRecord{}))["server"]["costliest_update"].is_null());
  EXPECT_EQ(json::parse(timing_json(record))["server"]["work"], (json{{"updates", 31},
                                                                      {"pairs_looked_at", 27730},
                                                                      {"places_compared", 190},
                                                                      {"pairs_verified", 36},
                                                                      {"hypotheses", 33},
                                                                      {"factorisations", 230},
                                                                      {"sample_products", 2303424}}));
}

TEST(ReportJson, CarriesTheRecordsFigures) {
  MissionRecord record = test::example_record();
  record.robots[0].onboard.rmse_m = 0.1234567891;
  const json report = json::parse(report_json(record));
  EXPECT_EQ(report["seed"], 7);
  EXPECT_DOUBLE_EQ(report["robots"][0]["onboard_rmse_m"], 0.123457);
  EXPECT_EQ(report["robots"][0]["policies"]["spectral"]["constraints"], 24);
  EXPECT_EQ(report["server"]["closures_accepted"], record.server.closures.size());
  EXPECT_EQ(report["server"]["closure_check"]["wrong"], 0);
  EXPECT_EQ(report["server"]["closures_rejected"], 31 + 55 + 4 + 9 + 0 + 3);
  const json overlap{{"reason", "overlap"}, {"intra", 31},  {"inter", 55},
                     {"nearest", 0.29},     {"limit", 0.3}, {"unit", ""}};
  EXPECT_EQ(report["server"]["rejections"][0], overlap);
  EXPECT_TRUE(report["server"]["rejections"][2]["nearest"].is_null());
  EXPECT_EQ(
      report["server"]["closures_accepted_intra"].get<int>() + report["server"]["closures_accepted_inter"].get<int>(),
      report["server"]["closures_accepted"].get<int>());
}

TEST(ReportJson, FollowsErrorsFromBroadcastToBroadcast) {
  MissionRecord record = test::example_record();
  record.server.updates = {
      {.time_s = 20.0, .closures = 3, .cost = 5.5, .degrees_of_freedom = 18, .wrong = 1},
      {.time_s = 40.0, .closures = 4, .cost = 7.25, .degrees_of_freedom = 24, .from_measurements = true}};
  record.robots[1].updates = {{.time_s = 21.0, .revision = 1},
                              {.time_s = 41.0,
                               .revision = 2,
                               .onboard_rmse_m = 0.5,
                               .server_rmse_m = 0.25,
                               .perfect_rmse_m = 0.125,
                               .answers = {{"spectral", 7, 0.375}, {"none", 0, {}}}}};
  const json report = json::parse(report_json(record));
  const json& course = report["robots"][1]["course"];
  ASSERT_EQ(course.size(), 2U);
  EXPECT_TRUE(course[0]["onboard_rmse_m"].is_null());
  EXPECT_EQ(course[1], (json{{"time_s", 41.0},
                             {"broadcast", 2},
                             {"onboard_rmse_m", 0.5},
                             {"server_rmse_m", 0.25},
                             {"perfect_rmse_m", 0.125},
                             {"policies",
                              {{"spectral", {{"rmse_m", 0.375}, {"constraints", 7}}},
                               {"none", {{"rmse_m", nullptr}, {"constraints", 0}}}}}}));
  EXPECT_EQ(report["server"]["course"], (json{{{"time_s", 20.0},
                                               {"closures_accepted", 3},
                                               {"closures_wrong", 1},
                                               {"cost", 5.5},
                                               {"degrees_of_freedom", 18},
                                               {"start", "closures"}},
                                              {{"time_s", 40.0},
                                               {"closures_accepted", 4},
                                               {"closures_wrong", nullptr},
                                               {"cost", 7.25},
                                               {"degrees_of_freedom", 24},
                                               {"start", "measurements"}}}));
}

TEST(ReportJson, ExplainsTheLastUpdateInMissionTime) {
  MissionRecord record = test::example_record();
  record.robots[1].start_s = 300.0;
  record.robots[0].explanation.reset();
  record.robots[1].explanation->direction_significance = 14.0;
  record.robots[0].alerts.clear();
  const json report = json::parse(report_json(record));
  EXPECT_TRUE(report["robots"][0]["explanation"].is_null());
  EXPECT_TRUE(report["robots"][0]["alerts"].empty());
  const json& explanation = report["robots"][1]["explanation"];
  EXPECT_TRUE(explanation["disagrees"]);
  EXPECT_EQ(explanation["nodes"], record.robots[1].explanation->stamps.size());
  ASSERT_EQ(explanation["largest_significance"].size(), explanation["scale_length_m"].size());
  EXPECT_NEAR(explanation["largest_significance"][4], 8.7, 1.0);
  EXPECT_DOUBLE_EQ(explanation["direction_significance"], 14.0);
  ASSERT_EQ(explanation["suspected_origins"].size(), 2U);
  const json& failure = explanation["suspected_origins"][1];
  EXPECT_DOUBLE_EQ(failure["from_s"], 362.0);
  EXPECT_DOUBLE_EQ(failure["until_s"], 372.0);
  EXPECT_DOUBLE_EQ(failure["scale_length_m"], 8.0);
  EXPECT_TRUE(failure["alert"]);
  ASSERT_EQ(report["robots"][1]["alerts"].size(), 1U);
  const json& alert = report["robots"][1]["alerts"][0];
  EXPECT_DOUBLE_EQ(alert["from_s"], 362.0);
  EXPECT_EQ(alert["place_m"], (json{12.34, -4.02, -0.01}));
  EXPECT_EQ(alert["known_since_broadcast"], record.robots[1].alerts[0].known_since_revision);
  EXPECT_TRUE(alert["withdrawn_s"].is_null());
  EXPECT_DOUBLE_EQ(report["robots"][1]["onboard_rpe_10m_m"], 0.095);
  EXPECT_DOUBLE_EQ(report["robots"][1]["policies"]["spectral"]["discontinuity_m"], 0.01);
}

TEST(ReportJson, MapErrorWhereThereIsASurvey) {
  MissionRecord record = test::example_record({.survey = true});
  const json report = json::parse(report_json(record));
  EXPECT_DOUBLE_EQ(report["server"]["map_error"]["rms_m"], 0.07);
  EXPECT_DOUBLE_EQ(report["server"]["survey_covered"], 0.97);
  EXPECT_DOUBLE_EQ(report["robots"][1]["map_error"]["onboard"]["mean_m"], 0.41);
  EXPECT_DOUBLE_EQ(report["robots"][1]["map_error"]["corrected"]["p95_m"], 0.15);
  const json& pose = report["server"]["T_reference_world"];
  const auto t = pose["translation_m"].get<std::vector<double>>();
  const auto q = pose["quaternion_xyzw"].get<std::vector<double>>();
  const Pose3 T{Eigen::Quaterniond(q[3], q[0], q[1], q[2]), Eigen::Vector3d(t[0], t[1], t[2])};
  EXPECT_LT(local(*record.server.T_reference_world, T).norm(), 1e-5);
  EXPECT_TRUE(json::parse(report_json(test::example_record()))["server"]["map_error"].is_null());
}

TEST(ReportJson, DriftIsInMissionTime) {
  MissionRecord record = test::example_record();
  record.robots[0].start_s = 2400.0;
  record.server.failed_odometry = {
      {record.robots[0].id, record.robots[0].odometry[3].stamp, record.robots[0].odometry[4].stamp, 1.5, 0.35}};
  const json report = json::parse(report_json(record));
  const json& origin = report["robots"][0]["drift_origins"][1];
  EXPECT_EQ(origin["kind"], "degeneracy");
  EXPECT_DOUBLE_EQ(origin["from_s"], 2436.0);
  EXPECT_DOUBLE_EQ(origin["until_s"], 2448.0);
  const json& failed = report["server"]["failed_odometry"][0];
  EXPECT_EQ(failed["robot"], "alpha");
  EXPECT_DOUBLE_EQ(failed["from_s"], 2406.0);
  EXPECT_DOUBLE_EQ(failed["error_m"], 1.5);
  EXPECT_DOUBLE_EQ(failed["error_rad"], 0.35);
}

TEST(ReportJson, StatesOnWhichShareOfTheDistanceEveryRmseWasScored) {
  MissionRecord record = test::example_record();
  record.robots[1].server.scored_share = record.robots[1].mapped_share = 0.07;
  record.server.joint.scored_share = 0.535;
  record.warnings = {"a warning"};
  record.server.closures = {{{record.robots[0].id, 3}, {record.robots[0].id, 40}}};
  const json report = json::parse(report_json(record));
  const json& robot = report["robots"][1];
  EXPECT_DOUBLE_EQ(robot["server_scored_share"], 0.07);
  EXPECT_EQ(robot["server_partial"], true);
  EXPECT_DOUBLE_EQ(robot["onboard_scored_share"], 1.0);
  EXPECT_EQ(robot["onboard_partial"], false);
  EXPECT_DOUBLE_EQ(robot["mapped_share"], 0.07);
  EXPECT_EQ(robot["policies"]["spectral"]["partial"], false);
  EXPECT_DOUBLE_EQ(robot["policies"]["spectral"]["agreement_scored_share"], 0.07);
  EXPECT_EQ(robot["policies"]["spectral"]["agreement_partial"], true);
  EXPECT_DOUBLE_EQ(report["server"]["scored_share"], 0.535);
  EXPECT_EQ(report["server"]["partial"], true);
  EXPECT_EQ(report["warnings"], json{"a warning"});
  EXPECT_EQ(report["robots"][0]["tied"], true);
  EXPECT_EQ(robot["tied"], false);
}

TEST(ReportJson, NotMeasuredIsNull) {
  MissionRecord record = test::example_record({.reference = false});
  record.robots[0].policies[0].agreement_rmse_m = std::numeric_limits<double>::quiet_NaN();
  record.robots[0].distance_m = std::numeric_limits<double>::infinity();
  const json report = json::parse(report_json(record));
  const json& robot = report["robots"][0];
  EXPECT_TRUE(robot["onboard_rmse_m"].is_null());
  EXPECT_TRUE(robot["server_rmse_m"].is_null());
  EXPECT_TRUE(robot["server_scored_share"].is_null());
  EXPECT_EQ(robot["server_partial"], false);
  EXPECT_TRUE(robot["distance_m"].is_null());
  EXPECT_TRUE(robot["policies"]["every_node"]["rmse_m"].is_null());
  EXPECT_TRUE(robot["policies"]["every_node"]["agreement_rmse_m"].is_null());
  EXPECT_FALSE(robot["policies"]["spectral"]["agreement_rmse_m"].is_null());
  EXPECT_TRUE(report["server"]["rmse_m"].is_null());
  EXPECT_TRUE(report["server"]["T_reference_world"].is_null());
  EXPECT_TRUE(robot["map_error"]["onboard"].is_null());
}

TEST(ReportJson, IsTheSameWhateverTheClockSays) {
  MissionRecord record = test::example_record();
  const std::string before = report_json(record);
  record.timing.wall_s = 99.0;
  record.timing.machine = "another";
  record.timing.policies.clear();
  record.version = "1.2.3";
  EXPECT_EQ(report_json(record), before);
  record.seed = 8;
  EXPECT_NE(report_json(record), before);
}

TEST(ReportJson, OneRotationIsAlwaysPrintedAlike) {
  MissionRecord record = test::example_record();
  const std::string before = report_json(record);
  auto& q = record.transforms[0].T_from_to.rotation;
  q.coeffs() = -q.coeffs();
  EXPECT_EQ(report_json(record), before);
}

TEST(ReportJson, EmptyMission) {
  const json report = json::parse(report_json(MissionRecord{}));
  EXPECT_TRUE(report["robots"].is_array());
  EXPECT_TRUE(report["robots"].empty());
  EXPECT_TRUE(report["transforms"].empty());
  EXPECT_EQ(report["server"]["components"], 0);
  EXPECT_EQ(json::parse(timing_json(MissionRecord{}))["format"], 3);
}

TEST(ReportJson, BrokenUtf8DoesNotThrow) {
  MissionRecord record;
  record.mission = "caf\xe9 \"quoted\"\n";
  EXPECT_NO_THROW(std::ignore = json::parse(report_json(record)));
}

TEST(TimingJson, MedianAndLargestPerPolicy) {
  MissionRecord record;
  record.timing.policies.push_back({"alpha", "spectral", {3.0, 1.0, 10.0, 2.0}, {}, {5.0}});
  const json policy = json::parse(timing_json(record))["policies"][0];
  EXPECT_EQ(policy["robot"], "alpha");
  EXPECT_EQ(policy["policy"], "spectral");
  EXPECT_EQ(policy["update"]["count"], 4);
  EXPECT_DOUBLE_EQ(policy["update"]["median_ms"], 2.5);
  EXPECT_DOUBLE_EQ(policy["update"]["max_ms"], 10.0);
  EXPECT_TRUE(policy["comparison"]["median_ms"].is_null());
  EXPECT_DOUBLE_EQ(policy["optimisation"]["median_ms"], 5.0);
}

}  // namespace json_test
}  // namespace tutti::mission
