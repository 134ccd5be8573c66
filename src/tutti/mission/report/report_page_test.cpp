// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/mission/report/page_messages.hpp"
#include "support/mission/report/report_example.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/view_recorder.hpp"

namespace tutti::mission {
namespace report_page_test {

using nlohmann::json;

TEST(ReportPage, HasEveryRobotsEstimatesAndErrors) {
  const MissionRecord record = test::example_record({.robots = 2, .keyframes = 40, .survey = true});
  const std::string page = report_html(record);
  const auto messages = test::messages_of(page);
  EXPECT_EQ(messages.at("mission").at("mode"), "report");
  EXPECT_EQ(messages.at("report"), json::parse(report_json(record)));
  EXPECT_TRUE(messages.contains("timing"));
  for (const RobotRecord& robot : record.robots) {
    for (const char* kind : {"onboard", "corrected", "server", "reference"})
      EXPECT_FALSE(messages.at("trajectory/" + robot.name + "/" + kind).at("points").empty()) << kind;
    const json errors = messages.at("errors/" + robot.name);
    EXPECT_EQ(errors.at("points").size(), 40U);
    EXPECT_EQ(errors.at("against"), "reference");
    const RobotGeometry geometry = robot_geometry(record, robot);
    for (std::size_t k = 0; k < 40; ++k) {
      const json& row = errors.at("points").at(k);
      EXPECT_NEAR(row.at(0).get<double>(), geometry.errors[k].time_s, 1e-3);
      EXPECT_NEAR(row.at(1).get<double>(), geometry.errors[k].onboard_m, 1e-3);
      EXPECT_NEAR(row.at(2).get<double>(), geometry.errors[k].corrected_m, 1e-3);
    }
  }
  EXPECT_TRUE(test::mission_of(page).at("clouds").contains("survey"));
}

/// In the frame of the map: where the server's estimate is there, moved by nothing.
TEST(ReportPage, TheServersTrajectoryLiesOnItsMap) {
  const MissionRecord record = test::example_record({.robots = 1, .keyframes = 30, .reference = false});
  const RobotRecord& robot = record.robots[0];
  const json points = test::messages_of(report_html(record)).at("trajectory/" + robot.name + "/server").at("points");
  ASSERT_EQ(points.size(), robot.server_estimate.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(points.at(k).at(static_cast<std::size_t>(axis + 1)).get<double>(),
                  robot.server_estimate[k].pose.translation(axis), 1e-3);
}

TEST(ReportPage, HasTheCourseOfTheMission) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 20});
  auto view = std::make_shared<ViewRecord>();
  view->messages = {{"poses", 1.0, R"({"revision":1})"}, {"poses", 2.0, R"({"revision":2})"}};
  view->clouds["0/3"] = "bytes";
  view->T_odom_submap[{ChainId(record.robots[0].id), 3}] = record.robots[0].odometry.front().pose;
  record.view = view;
  const std::string page = report_html(record);
  std::vector<double> times;
  const json mission = test::mission_of(page);
  for (const auto& message : mission.at("messages"))
    if (message.at("key") == "poses") times.push_back(message.at("t"));
  EXPECT_EQ(times, (std::vector<double>{1.0, 2.0}));
  EXPECT_TRUE(test::mission_of(page).at("clouds").contains("0/3"));
  const json odometry = test::messages_of(page).at("odometry").at("submaps");
  const json onboard = test::messages_of(page).at("trajectory/" + record.robots[0].name + "/onboard").at("points");
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(odometry.begin()->at(axis).get<double>(), onboard.at(0).at(axis + 1).get<double>(), 2e-3)
        << "where odometry begins";
}

TEST(ReportPage, NothingAndHostileNamesMakeAPageToo) {
  EXPECT_EQ(test::messages_of(report_html(MissionRecord{})).at("mission").at("mode"), "report");
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 10});
  record.robots[0].name = "</script><script>alert(1)</script>";
  record.description = "\xff<!--";
  const std::string page = report_html(record);
  EXPECT_TRUE(test::messages_of(page).contains("trajectory/</script><script>alert(1)</script>/onboard"));
  EXPECT_EQ(page.find("<script>alert(1)"), std::string::npos);
}

}  // namespace report_page_test
}  // namespace tutti::mission
