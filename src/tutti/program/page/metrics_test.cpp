// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/metrics.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

namespace tutti::page {
namespace metrics_test {

MissionStatus status() {
  MissionStatus status{.time = Timestamp{} + 100.0, .revision = 8};
  status.robots.push_back({.robot = RobotId{0},
                           .last_seen = Timestamp{} + 96.5,
                           .submaps = 9,
                           .status = {.name = "al\"pha\n", .backlog_submaps = 3, .health = {.battery_percent = 55.5}}});
  status.robots.push_back({.robot = RobotId{1}, .status = {.name = "bravo"}});
  status.workers.push_back({.number = 2, .last_seen = Timestamp{} + 99.0, .status = {.name = "w", .jobs_done = 4}});
  status.refusals.push_back({.from = "robot", .kind = "submap", .count = 5});
  return status;
}

TEST(Metrics, HasTheNumbersOfEveryone) {
  Metrics metrics;
  EXPECT_EQ(metrics.text(), "");
  EXPECT_FALSE(metrics.trouble().has_value());
  metrics.tell(status());
  const std::string text = metrics.text();
  for (const char* line :
       {"tutti_mission_revision 8\n", "tutti_robot_submaps{name=\"al\\\"pha \"} 9\n",
        "tutti_robot_backlog_submaps{name=\"bravo\"} 0\n", "tutti_robot_last_seen_s_ago{name=\"al\\\"pha \"} 3.5\n",
        "tutti_robot_battery_percent{name=\"al\\\"pha \"} 55.5\n", "tutti_worker_jobs_done{name=\"w\"} 4\n",
        "tutti_refused_messages{from=\"robot\",kind=\"submap\"} 5\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.find("battery_percent{name=\"bravo\"}"), std::string::npos) << "what is not known is not there";
  EXPECT_EQ(metrics.trouble(), "");
}

/// https://prometheus.io/docs/instrumenting/exposition_formats/
TEST(Metrics, IsWhatPrometheusReads) {
  Metrics metrics;
  metrics.tell(status());
  std::istringstream lines(metrics.text());
  const std::regex sample(R"re(([a-z_]+)(\{[a-z_]+="([^"\\]|\\.)*"(,[a-z_]+="([^"\\]|\\.)*")*\})? [-+0-9.e]+)re");
  const std::regex type("# TYPE ([a-z_]+) gauge");
  std::string line, current;
  std::set<std::string> seen;
  while (std::getline(lines, line)) {
    std::smatch match;
    if (std::regex_match(line, match, type)) {
      current = match[1];
      EXPECT_TRUE(seen.insert(current).second) << line << ": the samples of a gauge are side by side";
    } else {
      ASSERT_TRUE(std::regex_match(line, match, sample)) << line;
      EXPECT_EQ(match[1], current) << line;
    }
  }
  EXPECT_GT(seen.size(), 15U);
}

}  // namespace metrics_test
}  // namespace tutti::page
