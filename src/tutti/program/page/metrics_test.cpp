// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/metrics.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "support/paths.hpp"
#include "support/wire/messages.hpp"
#include "tutti/base/file.hpp"
#include "tutti/program/radio_count.hpp"

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
  metrics.update(status());
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

bus::Envelope message(bus::Endpoint from, bus::Endpoint to, bus::MessageKind kind, std::size_t bytes) {
  return {from, to, kind, "id", std::make_shared<const std::string>(bytes, 'x')};
}

MissionStatus with_radio(MissionStatus status) {
  using bus::Endpoint, bus::MessageKind;
  program::RadioCount radio;
  const auto alpha = Endpoint::of(RobotId{0}), stranger = Endpoint::of(RobotId{7});
  radio.count(message(alpha, Endpoint::server(), MessageKind::submap, 100));
  radio.count(message(alpha, Endpoint::server(), MessageKind::submap, 50));
  radio.count(message(Endpoint::server(), alpha, MessageKind::proxy_graph, 30));
  radio.count(message(stranger, Endpoint::server(), MessageKind::status, 5));
  radio.count(message(Endpoint::worker(1), Endpoint::server(), MessageKind::verdicts, 1000));
  status.radio = radio.sums();
  return status;
}

TEST(Metrics, CountsTheRadioByRobotAndKind) {
  Metrics metrics;
  metrics.update(with_radio(status()));
  const std::string text = metrics.text();
  for (const char* line : {"tutti_radio_bytes_total{name=\"al\\\"pha \",direction=\"up\",kind=\"submap\"} 150\n",
                           "tutti_radio_messages_total{name=\"al\\\"pha \",direction=\"up\",kind=\"submap\"} 2\n",
                           "tutti_radio_bytes_total{name=\"al\\\"pha \",direction=\"down\",kind=\"proxy graph\"} 30\n",
                           "tutti_radio_bytes_total{name=\"7\",direction=\"up\",kind=\"status\"} 5\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.find("1000"), std::string::npos) << "workers are not on the radio";
  EXPECT_EQ(radio_message(with_radio({})).value,
            R"({"0":{"up":{"submap":150},"down":{"proxy graph":30}},"7":{"up":{"status":5}}})");
}

/// Any status, many times: every number that may be there was there.
std::set<std::string> all_metrics() {
  std::set<std::string> out;
  const std::regex type("# TYPE ([a-z_]+) ");
  Rng rng(3);
  for (int i = 0; i < 40; ++i) {
    Metrics metrics;
    metrics.update(with_radio(wire::test::any_mission_status(rng)));
    const std::string text = metrics.text();
    for (auto at = std::sregex_iterator(text.begin(), text.end(), type); at != std::sregex_iterator(); ++at)
      out.insert((*at)[1]);
  }
  return out;
}

TEST(Metrics, TheDashboardAsksForWhatIsThere) {
  const auto offered = all_metrics();
  const std::string dashboard = read_file(tutti::test::source_path("deploy/grafana-dashboard.json").string()).value();
  const auto json = nlohmann::json::parse(dashboard);
  const std::regex name("tutti_[a-z_]+");
  std::size_t asked = 0;
  for (const auto& panel : json.at("panels"))
    for (const auto& target : panel.at("targets")) {
      const std::string expression = target.at("expr");
      for (auto at = std::sregex_iterator(expression.begin(), expression.end(), name); at != std::sregex_iterator();
           ++at, ++asked)
        EXPECT_TRUE(offered.contains(at->str())) << at->str() << " in '" << panel.at("title") << "'";
    }
  EXPECT_GT(asked, 15U);
}

TEST(RadioCount, IsBounded) {
  program::RadioCount radio;
  for (std::uint32_t i = 0; i < 2 * program::RadioCount::kMostRobots; ++i)
    radio.count(message(bus::Endpoint::of(RobotId{i}), bus::Endpoint::server(), bus::MessageKind::status, 1));
  EXPECT_EQ(radio.sums().size(), program::RadioCount::kMostRobots);
}

/// https://prometheus.io/docs/instrumenting/exposition_formats/
TEST(Metrics, IsWhatPrometheusReads) {
  Metrics metrics;
  metrics.update(with_radio(status()));
  std::istringstream lines(metrics.text());
  const std::regex sample(R"re(([a-z_]+)(\{[a-z_]+="([^"\\]|\\.)*"(,[a-z_]+="([^"\\]|\\.)*")*\})? [-+0-9.e]+)re");
  const std::regex type("# TYPE ([a-z_]+) (gauge|counter)");
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
