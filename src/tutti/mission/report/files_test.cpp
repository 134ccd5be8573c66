// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "support/mission/report/report_example.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::mission {
namespace files_test {

namespace fs = std::filesystem;

/// A folder of this test alone, gone afterwards.
class ReportFiles : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(dir_); }
  void TearDown() override { fs::remove_all(dir_); }
  [[nodiscard]] std::string text(const std::string& name) const {
    std::ifstream file(dir_ / name, std::ios::binary);
    EXPECT_TRUE(file) << name;
    std::ostringstream out;
    out << file.rdbuf();
    return out.str();
  }
  [[nodiscard]] std::set<std::string> names() const {
    std::set<std::string> out;
    for (const auto& entry : fs::directory_iterator(dir_)) out.insert(entry.path().filename().string());
    return out;
  }
  fs::path dir_ = fs::path(::testing::TempDir()) /
                  (std::string("tutti_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ReportFiles, WritesEverythingAndItReadsBack) {
  const MissionRecord record = test::example_record({.keyframes = 40, .survey = true});
  const fs::path nested = dir_ / "a" / "b";
  dir_ = nested;
  const auto status = write_report(record, dir_);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(names(),
            (std::set<std::string>{
                "report.json", "timing.json", "report.html", "config.yaml", "graph.g2o", "graph_stamps.csv", "map.ply",
                "survey.ply", "alpha_onboard.tum", "alpha_corrected.tum", "alpha_server.tum", "alpha_reference.tum",
                "bravo_onboard.tum", "bravo_corrected.tum", "bravo_server.tum", "bravo_reference.tum"}));
  EXPECT_EQ(text("report.json"), report_json(record));
  EXPECT_NO_THROW(std::ignore = nlohmann::json::parse(text("timing.json")));

  const auto corrected = formats::read_trajectory((dir_ / "bravo_corrected.tum").string());
  ASSERT_TRUE(corrected) << corrected.error().message;
  ASSERT_EQ(corrected->size(), 40U);
  EXPECT_EQ(corrected->back().stamp, record.robots[1].policies[2].corrected.back().stamp);
  EXPECT_EQ(corrected->back().pose.translation, record.robots[1].policies[2].corrected.back().pose.translation);

  const auto graph = formats::read_g2o((dir_ / "graph.g2o").string());
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(graph->graph.poses.size(), record.server.graph.poses.size());
  EXPECT_EQ(graph->graph.edges.size(), record.server.graph.edges.size());

  std::istringstream stamps(text("graph_stamps.csv"));
  std::string line;
  std::getline(stamps, line);
  EXPECT_EQ(line, "id,robot,keyframe,stamp_ns");
  for (std::size_t i = 0; i < record.server.nodes.size(); ++i) {
    ASSERT_TRUE(std::getline(stamps, line));
    const auto& node = record.server.nodes[i];
    EXPECT_EQ(line, fmt::format("{},{},{},{}", i, node.id.chain.robot.value, node.id.index, node.stamp.ns));
  }

  const auto cloud = formats::read_ply((dir_ / "map.ply").string());
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->points.size(), 2U * 40U * 60U);
  const auto survey = formats::read_ply((dir_ / "survey.ply").string());
  ASSERT_TRUE(survey) << survey.error().message;
  EXPECT_EQ(*survey, *record.survey);

  const auto config = parse_yaml(text("config.yaml"), "config.yaml");
  ASSERT_TRUE(config) << config.error().message;
  ASSERT_NE(config->find("seed"), nullptr);
  EXPECT_EQ(config->find("seed")->scalar, "7");
}

TEST_F(ReportFiles, LeavesOutWhatThereIsNot) {
  const auto status = write_report(test::example_record({.robots = 1, .keyframes = 20, .reference = false}), dir_);
  ASSERT_TRUE(status) << status.error().message;
  for (const char* cloud : {"map.ply", "survey.ply"}) EXPECT_FALSE(names().contains(cloud)) << cloud;
  EXPECT_FALSE(names().contains("alpha_reference.tum"));
  EXPECT_TRUE(names().contains("alpha_onboard.tum"));
}

TEST_F(ReportFiles, WhatAnEarlierMissionWroteIsNotTakenForThisOnes) {
  ASSERT_TRUE(write_report(test::example_record({.keyframes = 40, .survey = true}), dir_));
  const auto listed = nlohmann::json::parse(text("report.json"))["files"].get<std::set<std::string>>();
  EXPECT_EQ(listed, names());
  std::ofstream(dir_ / "delta_server.tum") << "the user's\n";
  std::ofstream(dir_ / "scan.pcd") << "the user's\n";
  const MissionRecord later = test::example_record({.robots = 1, .keyframes = 20, .reference = false});
  ASSERT_TRUE(write_report(later, dir_));
  EXPECT_EQ(names(), (std::set<std::string>{"report.json", "timing.json", "report.html", "config.yaml", "graph.g2o",
                                            "graph_stamps.csv", "alpha_onboard.tum", "alpha_corrected.tum",
                                            "alpha_server.tum", "delta_server.tum", "scan.pcd"}));
}

TEST_F(ReportFiles, RemovesNothingThatAReportCannotHaveWritten) {
  fs::create_directories(dir_ / "inner" / "survey.ply");  // a folder of that name
  std::ofstream(dir_ / "outside_server.tum") << "not in the folder\n";
  std::ofstream(dir_ / "inner" / "notes.txt") << "mine\n";
  std::ofstream(dir_ / "inner" / "map.ply") << "mine: the earlier mission had no clouds\n";
  std::ofstream(dir_ / "inner" / "report.json")
      << R"({"files": ["../outside_server.tum", "notes.txt", "survey.ply", "", "_server.tum", 7, null]})";
  ASSERT_TRUE(write_report(test::example_record({.robots = 1, .keyframes = 20}), dir_ / "inner"));
  for (const char* name : {"outside_server.tum", "inner/notes.txt", "inner/map.ply", "inner/survey.ply"})
    EXPECT_TRUE(fs::exists(dir_ / name)) << name;
  for (const char* foreign : {"", "[]", "{}", "{\"files\": {}}", "no json"}) {
    std::ofstream(dir_ / "inner" / "report.json") << foreign;
    EXPECT_TRUE(write_report(test::example_record({.robots = 1, .keyframes = 20}), dir_ / "inner")) << foreign;
  }
}

TEST_F(ReportFiles, EmptyMission) {
  const auto status = write_report(MissionRecord{}, dir_);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_TRUE(names().contains("report.html"));
}

TEST_F(ReportFiles, RobotNamesCannotLeaveTheFolder) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 10});
  record.robots[0].name = "../ev il";
  ASSERT_TRUE(write_report(record, dir_ / "inner"));
  EXPECT_EQ(names(), (std::set<std::string>{"inner"}));
  EXPECT_TRUE(fs::exists(dir_ / "inner" / "___ev_il_onboard.tum"));
}

TEST_F(ReportFiles, SaysWhereItCouldNotWrite) {
  fs::create_directories(dir_);
  std::ofstream(dir_ / "file") << "in the way";
  const auto status = write_report(MissionRecord{}, dir_ / "file" / "out");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::io);
  EXPECT_NE(status.error().message.find((dir_ / "file").string()), std::string::npos) << status.error().message;

  fs::create_directories(dir_ / "taken" / "report.json");  // a folder of that name
  const auto taken = write_report(MissionRecord{}, dir_ / "taken");
  ASSERT_FALSE(taken);
  EXPECT_NE(taken.error().message.find("report.json"), std::string::npos) << taken.error().message;
}

}  // namespace files_test
}  // namespace tutti::mission
