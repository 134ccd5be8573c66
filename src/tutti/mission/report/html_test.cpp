// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "support/mission/report/good_page.hpp"
#include "support/mission/report/report_example.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::mission {
namespace html_test {

using test::expect_good_page;
using test::has_number_that_is_not_finite;
using test::malformed;

/// What lies between every `open` and the `close` after it.
std::vector<std::string> all_between(const std::string& html, const std::string& open, const std::string& close) {
  std::vector<std::string> out;
  for (std::size_t at = html.find(open); at != std::string::npos; at = html.find(open, at)) {
    at += open.size();
    out.push_back(html.substr(at, html.find(close, at) - at));
  }
  return out;
}

/// What a reader sees of it: no tags.
std::string text_of(std::string html) {
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at))
    html.erase(at, html.find('>', at) + 1 - at);
  return html;
}

std::vector<std::string> headings(const std::string& html) { return all_between(html, "<h2>", "</h2>"); }

/// The section of that heading; empty when there is none.
std::string section_of(const std::string& html, const std::string& heading) {
  const auto found = all_between(html, "<h2>" + heading + "</h2>", "</section>");
  return found.empty() ? std::string() : found.front();
}

/// Cells of the rows that a reader sees in the tables of a piece of the page, the heads' left out.
std::vector<std::vector<std::string>> rows_of(const std::string& html) {
  std::vector<std::vector<std::string>> out;
  for (const std::string& row : all_between(html, "<tr", "</tr>")) {
    std::vector<std::string> cells;
    for (const std::string& cell : all_between(row, "<td", "</td>")) cells.push_back(text_of("<td" + cell));
    if (!cells.empty()) out.push_back(std::move(cells));
  }
  return out;
}

std::vector<std::string> first_cells(const std::string& html) {
  std::vector<std::string> out;
  for (const auto& row : rows_of(html)) out.push_back(row.front());
  return out;
}

TEST(CheckerOfThisTest, SeesMistakes) {
  EXPECT_EQ(malformed("<style>a > b</style><p class=\"x\">a &amp; b<br></p><path d=\"M0\"/>"), "");
  for (const char* wrong : {"<p><b></p></b>", "<p>", "</p>", "<p>a & b</p>", "<p>a < b</p>", "<p>a > b</p>",
                            "<p title=\"a & b\"></p>", "<p title=\"a</p>", "<p"})
    EXPECT_NE(malformed(wrong), "") << wrong;
  EXPECT_TRUE(has_number_that_is_not_finite("d=\"M0 0L1 nan\""));
  EXPECT_TRUE(has_number_that_is_not_finite("width:-inf%"));
  EXPECT_TRUE(has_number_that_is_not_finite("<td>nan m</td>"));
  EXPECT_FALSE(has_number_that_is_not_finite("information, finance, banana"));
}

TEST(ReportHtml, IsWellFormedAndSelfContained) { expect_good_page(report_html(test::example_record({.cloud = true}))); }

TEST(ReportHtml, HasEverySectionInOrder) {
  const std::string html = report_html(test::example_record({.cloud = true}));
  const std::vector<std::string> expected{"The joint map",
                                          "The map: odometry alone, and joint",
                                          "Who drifted where and when",
                                          "Where odometry and map part",
                                          "Each robot by itself",
                                          "Policies side by side",
                                          "The proxy graph",
                                          "Loop closures",
                                          "How the robots&#39; frames lie",
                                          "What goes over the radio",
                                          "Time",
                                          "What to keep in mind"};
  EXPECT_EQ(headings(html), expected);
  EXPECT_NE(html.find("<details><summary>Effective configuration</summary>"), std::string::npos);
  const std::vector<std::vector<std::string>> closures = rows_of(section_of(html, "Loop closures"));
  ASSERT_EQ(closures.size(), 4U);
  EXPECT_EQ(closures[2], (std::vector<std::string>{"refused: free to slide", "4", "9", "13"}));
}

TEST(ReportHtml, PoliciesSideBySideAreThoseOfTheRecord) {
  MissionRecord record = test::example_record();
  const std::string several = section_of(report_html(record), "Policies side by side");
  const std::vector<std::string> of_a_robot{
      "onboard (raw odometry)", "every_node", "every_node_2", "spectral", "uniform", "random", "skeleton", "server"};
  std::vector<std::string> expected;
  for (const char* robot : {"alpha", "bravo"}) {
    expected.emplace_back(robot);
    expected.insert(expected.end(), of_a_robot.begin(), of_a_robot.end());
  }
  EXPECT_EQ(first_cells(several), expected);
  const auto rows = rows_of(several);
  EXPECT_EQ(rows.at(1), (std::vector<std::string>{"onboard (raw odometry)", "0.712 m", "1.400 m", "0.021 m", "0.095 m",
                                                  "100 %", "", "", "", "", ""}));
  EXPECT_EQ(rows.at(4), (std::vector<std::string>{"spectral", "0.034 m", "0.080 m", "0.016 m", "0.022 m", "100 %",
                                                  "0.010 m", "0.020 m", "24", "20.2 %", "11.2 / 31.0"}));

  test::keep_the_default_policy(record);
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_EQ(section_of(html, "Policies side by side"), "");
  const std::string one = section_of(html, "Each robot in figures");
  EXPECT_EQ(rows_of(one).at(2), rows.at(4));
  EXPECT_EQ(first_cells(one), (std::vector<std::string>{"alpha", "onboard (raw odometry)", "spectral", "server",
                                                        "bravo", "onboard (raw odometry)", "spectral", "server"}));
  EXPECT_EQ(one.find("roadcast"), std::string::npos) << one;  // nothing is side by side
}

TEST(ReportHtml, ShowsTheMapBesideTheSurvey) {
  const std::string html = report_html(test::example_record({.survey = true}));
  expect_good_page(html);
  EXPECT_NE(html.find("The map beside the survey"), std::string::npos);
  EXPECT_NE(html.find("its map, mean distance to the survey: <b>0.410 m → 0.060 m</b>"), std::string::npos);
  std::size_t pictures = 0;  // one under the joint map; four from above and four sections; two disagreement maps
  for (std::size_t at = html.find("<image"); at != std::string::npos; at = html.find("<image", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 11U);
}

TEST(ReportHtml, MarksDriftAndNamesSuspectedFailures) {
  MissionRecord record = test::example_record();
  std::string html = report_html(record);
  for (const char* kind : {"drift slip", "drift degeneracy", "drift failure"})
    EXPECT_NE(html.find(std::string("<rect class=\"") + kind), std::string::npos) << kind;
  EXPECT_EQ(html.find("suspected by the server"), std::string::npos);
  const auto& robot = record.robots[1];
  record.robots[1].start_s = 300.0;
  record.server.failed_odometry = {{robot.id, robot.odometry[6].stamp, robot.odometry[15].stamp, 2.41, 0.05}};
  html = report_html(record);
  expect_good_page(html);
  EXPECT_NE(html.find("suspected by the server:</b> bravo, 312.0 s - 330.0 s: 2.410 m, 2.9 deg"), std::string::npos);
  EXPECT_NE(html.find("<rect class=\"suspect\""), std::string::npos);
}

TEST(ReportHtml, ExplainsWhereOdometryAndMapPart) {
  MissionRecord record = test::example_record();
  record.robots[0].start_s = 600.0;
  for (auto& alert : record.robots[0].alerts) alert.known_since_s += 600.0;
  std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_NE(html.find("Where odometry and map part"), std::string::npos);
  EXPECT_NE(
      html.find(
          "Localisation failure suspected:</b> alpha, 662.0 s - 672.0 s, at (12.3, -4.0, 0.0) m: 1.87 m, 17.8 deg over "
          "7.00 m (scale 8.0 m), "
          "noticed by the robot at 720.0 s"),
      std::string::npos);
  EXPECT_NE(html.find("<td>failure, 660.0 s - 672.0 s: 1.900 m, 17.2 deg</td>"), std::string::npos) << "the true one";
  for (const char* shape : {"<rect class=\"origin alert\"", "<rect class=\"origin\"", "<rect class=\"truth failure\"",
                            "<rect class=\"originbox\""})
    EXPECT_NE(html.find(shape), std::string::npos) << shape;
  record.robots[0].alerts[0].withdrawn_s = 770.0;
  EXPECT_NE(report_html(record).find("Localisation failure no longer suspected:</b> alpha"), std::string::npos);
}

TEST(ReportHtml, NamesOdometryThatIsBetterThanStated) {
  MissionRecord record = test::example_record();
  EXPECT_EQ(report_html(record).find("turns better"), std::string::npos);
  record.robots[0].rotation_factor = 0.16;
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_NE(html.find("odometry turns better than it says (at least: alpha 2.5 times); the server"), std::string::npos);
}

TEST(ReportHtml, SaysWhenNothingHadToBeAdded) {
  MissionRecord record = test::example_record({.robots = 1});
  auto& robot = record.robots[0];
  robot.explanation = test::example_explanation(robot.server_estimate, {});
  robot.policies[2].constraints_added = 0;
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_NE(html.find("odometry and map agree within what the server is sure of"), std::string::npos);
  EXPECT_NE(html.find("nothing was added"), std::string::npos);
  EXPECT_EQ(html.find("<rect class=\"origin"), std::string::npos);
}

TEST(ReportHtml, ListsTrafficByKindAndTheServersLoad) {
  MissionRecord record = test::example_record();
  record.robots[0].traffic = {{"alpha", "server", "sub<map", 24, 812'345, 900'000, 3398.0, 41'000}};
  record.timing.server_load = {3600.0, 30.0, 150.0, {20.0, 4000.0, 9000.0}, 512.0};
  const std::string html = report_html(record);
  expect_good_page(html);
  for (const char* cell :
       {"sub&lt;map", "812 kB", "900 kB", "3.40 kB/s", "0.83 %", "4.17 %", "20 x", "4.00 s / 9.00 s", "512 MB"})
    EXPECT_NE(html.find(cell), std::string::npos) << cell;
}

TEST(ReportHtml, IsAFunctionOfTheRecord) {
  EXPECT_EQ(report_html(test::example_record()), report_html(test::example_record()));
}

TEST(ReportHtml, EscapesEveryText) {
  MissionRecord record = test::example_record({.keyframes = 40});
  const std::string evil = "</title><b>&\"'";
  record.mission = record.description = record.input = record.version = evil;
  record.effective_config_yaml = record.timing.machine = record.rpe_interval = evil;
  record.notes = record.warnings = {evil};
  record.default_policy = evil;
  for (auto& robot : record.robots) {
    robot.name = evil + robot.name;
    robot.policies[2].name = evil;
  }
  record.transforms[0].from = record.transforms[0].to = evil;
  for (auto& timing : record.timing.policies) timing.robot = timing.policy = evil;
  record.timing.load = {{evil, 0.5, 12.0}};
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_EQ(html.find(evil), std::string::npos);
}

TEST(ReportHtml, WorksWithoutReferenceCloudOrUpdates) {
  MissionRecord record = test::example_record({.reference = false});
  for (auto& robot : record.robots) robot.updates.clear();
  record.timing = {};
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_EQ(html.find("Where and when"), std::string::npos);
  EXPECT_NE(html.find("no reference"), std::string::npos);
  // How far corrected and server agree is no accuracy, and stands nowhere as large as one.
  const std::string robots = html.substr(0, html.find("<div class=\"cards\">"));
  EXPECT_EQ(all_between(robots, "<p class=\"value\">", "</p>"),
            std::vector<std::string>(record.robots.size(), "not measured <small>no reference</small>"));
  EXPECT_EQ(all_between(robots, "corrected and server agree within ", "<").size(), record.robots.size());
}

TEST(ReportHtml, EmptyMission) { expect_good_page(report_html(MissionRecord{})); }

TEST(ReportHtml, RobotThatNeverMovedOrSpoke) {
  MissionRecord record;
  record.robots.push_back({.name = "silent"});
  RobotRecord& still = record.robots.emplace_back(RobotRecord{.id = {1}, .name = "still"});
  still.odometry = {{Timestamp{5}, Pose3{}}};
  still.server_estimate = still.reference = still.odometry;
  still.updates = {{.time_s = 20.0, .revision = 1}};
  expect_good_page(report_html(record));
}

TEST(ReportHtml, SurvivesNumbersThatAreNotFinite) {
  MissionRecord record = test::example_record({.keyframes = 60});
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  record.robots[0].odometry[7].pose.translation.x() = kNaN;
  record.robots[0].policies[2].corrected[9].pose.translation.y() = std::numeric_limits<double>::infinity();
  record.robots[0].onboard.rmse_m = kNaN;
  record.robots[0].explanation->significance(4, 2) = kNaN;
  record.robots[0].explanation->significance(9, 1) = std::numeric_limits<double>::infinity();
  record.robots[0].explanation->origins[0].translation_m = kNaN;
  record.robots[0].explanation->origins[1].significance = std::numeric_limits<double>::infinity();
  record.robots[0].explanation->scale_length_m[3] = kNaN;
  record.server.proxy.nodes[5].T_world_body.translation.z() = kNaN;
  record.transforms[0].T_from_to.translation.x() = kNaN;
  expect_good_page(report_html(record));
}

TEST(ReportHtml, GroupsThatNeverMetGetTheirOwnPicture) {
  MissionRecord record = test::example_record({.robots = 3, .keyframes = 60});
  record.robots[2].component = 1;
  record.server.components = 2;
  record.server.proxy.components[2].component = 1;
  const std::string html = report_html(record);
  expect_good_page(html);
  std::size_t pictures = 0;
  for (std::size_t at = html.find("The joint map from above"); at != std::string::npos;
       at = html.find("The joint map from above", at + 1))
    ++pictures;
  EXPECT_EQ(pictures, 2U);
}

TEST(ReportHtml, EveryRobotHasItsDisagreementMapAndOriginsBelowIt) {
  MissionRecord record = test::example_record();
  const auto section = [&] { return section_of(report_html(record), "Where odometry and map part"); };
  const auto robots = [&] { return all_between(section(), "<figcaption><b>", "</b>"); };
  const std::vector<std::string> both{"alpha", "bravo"};
  EXPECT_EQ(robots(), both);
  EXPECT_EQ(rows_of(section()).size(), 4U);  // two origins each
  record.robots[0].explanation = test::example_explanation(record.robots[0].server_estimate, {});
  EXPECT_EQ(robots(), both);
  EXPECT_EQ(rows_of(section()).size(), 2U);
  record.robots[0].explanation.reset();
  EXPECT_EQ(robots(), std::vector<std::string>{"bravo"});
}

TEST(ReportHtml, FiguresOfOneOfSeveralMapsNameItsRobots) {
  MissionRecord record = test::example_record({.robots = 3, .cloud = true, .survey = true});
  EXPECT_NE(report_html(record).find("all robots in one alignment"), std::string::npos);
  record.robots[1].component = 1;
  record.server.components = 2;
  const std::string apart = report_html(record);
  expect_good_page(apart);
  for (const char* words : {"alpha and charlie in one alignment", "alpha and charlie; 95 %",
                            "<td class=\"left\">alpha and charlie</td>", "The joint map of alpha and charlie is"})
    EXPECT_NE(apart.find(words), std::string::npos) << words;
  EXPECT_EQ(apart.find("all robots"), std::string::npos) << apart.substr(apart.find("all robots") - 100, 200);
}

TEST(ReportHtml, APartialFigureIsMarkedAndNoHeadline) {
  MissionRecord record = test::example_record({.robots = 1, .survey = true});
  const auto headline = [](const std::string& html) { return html.substr(0, html.find("The joint map")); };
  const std::string whole = report_html(record);
  EXPECT_EQ(whole.find("(0.017 m)"), std::string::npos);
  EXPECT_NE(headline(whole).find("<small>server 0.017 m</small>"), std::string::npos);
  EXPECT_NE(headline(whole).find("<p class=\"value\">0.018 m</p>"), std::string::npos);
  record.server.joint.scored_share = record.robots[0].server.scored_share = record.robots[0].mapped_share = 0.0699;
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_NE(headline(html).find("<small>server -</small>"), std::string::npos);
  EXPECT_NE(headline(html).find("partial, scored on 6 % of its trajectory only: server (0.017 m)"), std::string::npos);
  for (const char* figure : {"0.018 m", "0.050 m"}) {  // of the joint map: RMSE, and mean distance to the survey
    EXPECT_EQ(headline(html).find(std::string("<p class=\"value\">") + figure), std::string::npos) << figure;
    EXPECT_NE(headline(html).find(std::string("of all robots' trajectories only: (") + figure), std::string::npos)
        << figure;
  }
  EXPECT_NE(html.find("server (0.017 m, partial: on 6 %)"), std::string::npos) << "over the curves";
  EXPECT_NE(html.find("<td class=\"left\">server</td><td>(0.017 m)</td>"), std::string::npos) << "in the table";
  record.robots[0].onboard = record.robots[0].server = {};  // no reference
  for (PolicyRecord& policy : record.robots[0].policies) policy.accuracy = {};
  EXPECT_NE(headline(report_html(record)).find("to the server (0.020 m)"), std::string::npos);
}

TEST(ReportHtml, WarningsAreInTheHeadline) {
  MissionRecord record = test::example_record();
  record.warnings = {"alpha & the rest"};
  const std::string html = report_html(record);
  expect_good_page(html);
  EXPECT_LT(html.find("<b>Warning:</b> alpha &amp; the rest"), html.find("Error of every robot"));
}

TEST(ReportHtml, LongMissionStaysSmall) {
  const std::string html = report_html(test::example_record({.robots = 3, .keyframes = 1000}));
  EXPECT_LT(html.size(), 2'000'000U);
  EXPECT_LT(report_html(test::example_record({.robots = 3, .keyframes = 1000, .survey = true})).size(),
            html.size() + 4'000'000U);  // pictures, however many the points
}

}  // namespace html_test
}  // namespace tutti::mission
