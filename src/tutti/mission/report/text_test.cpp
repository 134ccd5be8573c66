// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "support/mission/report/report_example.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::mission {
namespace text_test {

void expect_readable(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100U) << line;
    EXPECT_TRUE(line.empty() || line.back() != ' ') << "trailing blank: " << line;
  }
  EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
}

/// Every run of blanks and line ends as one blank.
std::string unwrapped(const std::string& text) {
  std::string out;
  std::istringstream words(text);
  for (std::string word; words >> word;) out += word + " ";
  return out;
}

std::string line_with(const std::string& text, const std::string& word) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.find(word) != std::string::npos) return line;
  return "";
}

TEST(ReportText, FitsTheScreenAndEndsWithThePath) {
  for (const std::size_t robots : {0U, 1U, 2U, 3U, 5U}) {
    const std::string text = report_text(test::example_record({.robots = robots}), "out/report.html");
    expect_readable(text);
    EXPECT_TRUE(text.ends_with("Report: out/report.html\n"));
  }
}

TEST(ReportText, ShowsTheFigures) {
  const std::string text = report_text(test::example_record(), "x");
  EXPECT_NE(line_with(text, "onboard").find("0.712 m  1.400 m"), std::string::npos) << text;
  EXPECT_NE(line_with(text, "every_node ").find("119"), std::string::npos) << text;
  EXPECT_NE(line_with(text, "spectral *").find("0.034 m"), std::string::npos) << text;
  EXPECT_NE(line_with(text, "server   1 map of 2 robots").find("18 between robots"), std::string::npos) << text;
  EXPECT_NE(text.find("simulated"), std::string::npos);
  EXPECT_NE(text.find("kB/s"), std::string::npos);
}

TEST(ReportText, PoliciesAreSideBySideOnlyWhereThereAreSeveral) {
  MissionRecord record = test::example_record();
  EXPECT_NE(report_text(record, "x").find("Policies side by side"), std::string::npos);
  test::keep_the_default_policy(record);
  const std::string text = report_text(record, "x");
  expect_readable(text);
  EXPECT_EQ(text.find("olic"), std::string::npos) << text;
  EXPECT_EQ(text.find("\n\n\n"), std::string::npos) << text;     // no gap where the table was
  const std::string corrected = line_with(text, " corrected ");  // the robots' table has it all
  EXPECT_NE(corrected.find("0.034 m"), std::string::npos) << text;
  EXPECT_NE(corrected.find("  24  11.2 / 31.0"), std::string::npos) << text;
}

TEST(ReportText, ReportsAlertsAndDiscontinuities) {
  MissionRecord record = test::example_record();
  const std::string text = report_text(record, "x");
  expect_readable(text);
  EXPECT_NE(text.find("alert    alpha: localisation failure suspected, 62.0 s - 72.0 s, at (12.3, -4.0, 0.0) m:"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("compare  bravo: odometry and map differ by up to"), std::string::npos) << text;
  EXPECT_NE(text.find("change   alpha: correcting changed no motion over 1 s by more than 0.010 m and 0.400 deg"),
            std::string::npos)
      << text;
  ASSERT_EQ(text.find("better than it says"), std::string::npos);
  record.robots[1].rotation_factor = 0.25;
  EXPECT_NE(report_text(record, "x").find("odometry turns better than it says (at least: bravo 2.0"),
            std::string::npos);
  record.robots[1].explanation->direction_significance = 44.0;
  const std::string missed = report_text(record, "x");
  expect_readable(missed);
  EXPECT_NE(missed.find("odometry and map differ by up to 44 x the threshold, in what"), std::string::npos) << missed;
  record.robots.resize(1);
  record.robots[0].explanation = test::example_explanation(record.robots[0].server_estimate, {});
  record.robots[0].alerts.clear();
  record.robots[0].policies[2].constraints_added = 0;
  const std::string quiet = report_text(record, "x");
  EXPECT_EQ(quiet.find("localisation failure"), std::string::npos);
  EXPECT_NE(quiet.find("agree within what the server is sure of; nothing was added"), std::string::npos) << quiet;
  EXPECT_EQ(quiet.find("  change   "), std::string::npos);
}

TEST(ReportText, SaysWhenThereIsNoReference) {
  const std::string text = report_text(test::example_record({.reference = false}), "x");
  EXPECT_NE(text.find("No reference"), std::string::npos);
  expect_readable(text);
}

TEST(ReportText, FiguresOfOneOfSeveralMapsNameItsRobots) {
  MissionRecord record = test::example_record({.robots = 3});
  EXPECT_NE(unwrapped(report_text(record, "x")).find("over all robots at once"), std::string::npos);
  record.robots[1].component = 1;
  record.server.components = 2;
  const std::string apart = unwrapped(report_text(record, "x"));
  EXPECT_EQ(apart.find("all robots"), std::string::npos) << apart;
  EXPECT_NE(apart.find("over alpha and charlie at once"), std::string::npos) << apart;
  EXPECT_NE(apart.find("2 maps (alpha + charlie; bravo) of 3 robots"), std::string::npos) << apart;
  record.server.largest_component = 1;
  EXPECT_EQ(format_mapped_robots(record), "bravo");
  EXPECT_EQ(format_maps(record), "alpha + charlie; bravo");
}

TEST(ReportText, APartialFigureIsMarkedAndNoHeadline) {
  MissionRecord record = test::example_record();
  const std::string whole = report_text(record, "x");
  EXPECT_EQ(whole.find("partial"), std::string::npos) << whole;
  EXPECT_NE(unwrapped(whole).find("server 0.017 m 0.050 m 0.024 m 0.026 m 100 %"), std::string::npos) << whole;
  EXPECT_NE(unwrapped(whole).find("at once (max 0.061 m; scored on 100 % of the trajectory)"), std::string::npos);
  record.robots[1].server.scored_share = record.robots[1].mapped_share = 0.0699;
  record.server.joint.scored_share = 0.5349;
  const std::string text = report_text(record, "x");
  expect_readable(text);
  EXPECT_NE(unwrapped(text).find("server (0.017 m) (0.050 m) 0.024 m 0.026 m 6 %"), std::string::npos) << text;
  EXPECT_NE(text.find("In brackets: partial, below 95 %."), std::string::npos);
  EXPECT_NE(line_with(text, "spectral *").find("(0.020 m)"), std::string::npos) << "bravo's distance to the server";
  EXPECT_NE(unwrapped(text).find(
                "partial: RMSE (0.018 m) over all robots at once is scored on 53 % of all robots' trajectories"),
            std::string::npos)
      << text;
  record.robots[1].server.scored_share = kPartialBelow;
  EXPECT_EQ(report_text(record, "x").find("(0.017 m)"), std::string::npos);
}

TEST(ReportText, WarningsComeFirst) {
  MissionRecord record = test::example_record();
  record.warnings = {"the server's map is odometry alone: no two submaps were compared"};
  const std::string text = report_text(record, "x");
  expect_readable(text);
  EXPECT_TRUE(text.starts_with("\nWarning: the server's map is odometry alone")) << text;
}

TEST(ReportText, NothingToCompareWithIsNoAgreement) {
  MissionRecord record = test::example_record({.robots = 1});
  record.robots[0].explanation = test::example_explanation(record.robots[0].server_estimate, {});
  EXPECT_NE(report_text(record, "x").find("odometry and map agree"), std::string::npos);
  record.server.closures.clear();
  const std::string alone = report_text(record, "x");
  EXPECT_EQ(alone.find("agree"), std::string::npos) << alone;
  EXPECT_NE(alone.find("there was nothing to compare odometry with"), std::string::npos) << alone;
}

TEST(ReportText, EmptyMission) { expect_readable(report_text(MissionRecord{}, "x")); }

TEST(ReportText, AMissionNeedNotSayWhatItsInputIs) {
  MissionRecord record = test::example_record();
  EXPECT_NE(report_text(record, "x").find("\nInput: simulated. Seed 7, "), std::string::npos);
  record.input.clear();
  EXPECT_NE(report_text(record, "x").find("\nSeed 7, "), std::string::npos);
}

TEST(Format, Words) {
  EXPECT_EQ(format_metres(std::nullopt), "-");
  EXPECT_EQ(format_metres(0.0126), "0.013 m");
  EXPECT_EQ(format_distance(999.4), "999 m");
  EXPECT_EQ(format_distance(1210.0), "1.21 km");
  EXPECT_EQ(format_duration_ms(0.4249), "0.42 ms");
  EXPECT_EQ(format_duration_ms(12.34), "12.3 ms");
  EXPECT_EQ(format_duration_ms(1234.0), "1.23 s");
  EXPECT_EQ(format_mission_time(59.6), "1 min 00 s");
  EXPECT_EQ(format_mission_time(580.0), "9 min 40 s");
  EXPECT_EQ(format_mission_time(3720.0), "1 h 02 min");
  EXPECT_EQ(format_bytes(812.0), "812 B");
  EXPECT_EQ(format_bytes(3424.0), "3.42 kB");
  EXPECT_EQ(format_bytes(999'600.0), "1.00 MB");
}

TEST(Format, SpreadIsMedianAndLargest) {
  EXPECT_FALSE(spread({}).has_value());
  const std::vector<double> odd{5.0, 1.0, 3.0};
  EXPECT_DOUBLE_EQ(spread(odd)->median, 3.0);
  EXPECT_DOUBLE_EQ(spread(odd)->max, 5.0);
  const std::vector<double> even{4.0, 1.0, 2.0, 9.0};
  EXPECT_DOUBLE_EQ(spread(even)->median, 3.0);
  EXPECT_EQ(format_spread(even), "3.0 / 9.0");
}

}  // namespace text_test
}  // namespace tutti::mission
