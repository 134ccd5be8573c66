// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/compare.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/mission/report/explanation_example.hpp"
#include "support/mission/report/page_messages.hpp"

namespace tutti::mission {
namespace compare_test {

using nlohmann::json;

/// A straight trajectory of a metre a second; B parts from it after 40 s.
TrajectoryComparison example(bool disagrees) {
  TrajectoryComparison c{.name = "alpha", .poses = 205, .paired = 200, .spacing_m = 1.0, .length_m = 99.0};
  for (int i = 0; i < 100; ++i) {
    const Timestamp stamp = Timestamp{1'700'000'000'000'000'000} + static_cast<double>(i);
    const double x = static_cast<double>(i);
    c.judge.push_back({stamp, {Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}}});
    c.judged.push_back({stamp, {Eigen::Quaterniond::Identity(), {x, i < 40 ? 0.0 : 0.1 * (x - 40.0), 0.0}}});
  }
  c.corrected = c.judge;
  std::vector<consistency::SuspectedOrigin> origins;
  if (disagrees) {
    origins = {{.from = c.judge[38].stamp,
                .until = c.judge[44].stamp,
                .place_m = {38.0, 1.0, 2.0},
                .scale = 3,
                .length_m = 6.0,
                .translation_m = 0.4,
                .rotation_rad = 0.05,
                .significance = 4.0,
                .alert = true}};
    consistency::Constraint link;
    link.from = 38;
    link.to = 60;
    link.from_stamp = c.judge[38].stamp;
    link.to_stamp = c.judge[60].stamp;
    link.measurement.T_a_b = c.judge[38].pose.inverse() * c.judge[60].pose;
    c.constraints = {link};
  }
  c.explanation = test::example_explanation(c.judge, origins);
  c.before = {.pairs = 100, .rmse_m = 1.234, .max_m = 3.0, .rmse_deg = 0.5};
  c.after = {.pairs = 100, .rmse_m = 0.012, .max_m = 0.03, .rmse_deg = 0.1};
  c.discontinuity = {0.11, 2.9, {}, {}};
  return c;
}

CompareReport report(bool disagrees) {
  return {.a = "truth.tum", .b = "odometry & co.tum", .robots = {example(disagrees)}, .notes = {"A <note>."}};
}

void expect_in(const std::string& text, std::initializer_list<const char*> all) {
  for (const char* expected : all) EXPECT_NE(text.find(expected), std::string::npos) << expected << " in\n" << text;
}

TEST(ScaleSummaries, SayHowMuchWhereAndSinceWhen) {
  consistency::Explanation e = test::example_explanation(example(false).judge, {});
  e.significance.setConstant(0.3);
  e.significance(50, 2) = 1.5;
  e.significance(70, 2) = 6.0;
  e.significance(70, 4) = 0.9;
  const auto scales = scale_summaries(e);
  ASSERT_EQ(scales.size(), 6U);
  EXPECT_EQ(scales[2].since, e.stamps[50]);
  EXPECT_EQ(scales[2].worst, e.stamps[70]);
  EXPECT_EQ(scales[2].significance, 6.0);
  EXPECT_EQ(scales[2].length_m, 32.0);
  EXPECT_EQ(scales[4].worst, e.stamps[70]);
  EXPECT_FALSE(scales[4].since);
  EXPECT_TRUE(scale_summaries({}).empty());
}

TEST(CompareText, TellsWhereSinceWhenAndWhatWouldFixIt) {
  const std::string text = compare_text(report(true));
  expect_in(text, {"truth.tum", "odometry & co.tum", "alpha", "200 of 205 poses", "1.234 m RMSE",
                   "They disagree, by up to 4.0 x the threshold", "38.0 s  44.0 s", "failure?", "would fix B: 1",
                   "38.0 s  60.0 s  22.000 m", "off A by 0.012 m RMSE", "0.110 m and 2.900 deg", "note  A <note>."});
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

TEST(CompareText, SaysSoWhenTheyAgree) {
  const std::string text = compare_text(report(false));
  expect_in(text, {"They agree"});
  EXPECT_EQ(text.find("disagree"), std::string::npos);
  EXPECT_EQ(text.find("would fix"), std::string::npos);
}

TEST(CompareJson, HasEverything) {
  const json out = json::parse(compare_json(report(true)));
  EXPECT_TRUE(out["disagree"]);
  EXPECT_EQ(out["b"], "odometry & co.tum");
  const json& robot = out["robots"][0];
  EXPECT_EQ(robot["name"], "alpha");
  EXPECT_EQ(robot["nodes"], 100);
  EXPECT_EQ(robot["scales"].size(), 6U);
  EXPECT_EQ(robot["origins"][0]["from_s"], 38.0);
  EXPECT_EQ(robot["origins"][0]["from_stamp_ns"], 1'700'000'038'000'000'000);
  EXPECT_TRUE(robot["origins"][0]["alert"]);
  EXPECT_EQ(robot["origins"][0]["place_m"].size(), 3U);
  EXPECT_EQ(robot["constraints"][0]["to_s"], 60.0);
  EXPECT_EQ(robot["constraints"][0]["T_from_to"]["translation_m"][0], 22.0);
  EXPECT_EQ(robot["fixed"]["rmse_m"], 0.012);
  EXPECT_EQ(robot["map"]["stamp_ns"].size(), 100U);
  EXPECT_EQ(robot["map"]["significance"].size(), 100U);
  EXPECT_EQ(robot["map"]["significance"][0].size(), 6U);
  const json quiet = json::parse(compare_json(report(false)));
  EXPECT_FALSE(quiet["disagree"]);
  EXPECT_TRUE(quiet["robots"][0]["fixed"].is_null());
  EXPECT_TRUE(quiet["robots"][0]["origins"].empty());
}

TEST(ComparePage, HasBothTrajectoriesAndTheFigures) {
  const auto messages = test::messages_of(compare_html(report(true)));
  EXPECT_EQ(messages.at("mission").at("mode"), "compare");
  EXPECT_EQ(messages.at("mission").at("name"), "odometry & co.tum");
  EXPECT_EQ(messages.at("trajectory/alpha/server").at("points").size(), 100U);
  EXPECT_EQ(messages.at("trajectory/alpha/onboard").at("points").at(0).at(0), 0.0) << "seconds after B's first pose";
  EXPECT_TRUE(messages.contains("trajectory/alpha/corrected"));
  EXPECT_EQ(messages.at("disagreement/alpha").at("nodes").size(), 100U);
  EXPECT_EQ(messages.at("disagreement/alpha").at("origins").at(0).at("from_s"), 38.0);
  EXPECT_EQ(messages.at("compare"), json::parse(compare_json(report(true))));
  EXPECT_FALSE(test::messages_of(compare_html(report(false))).contains("trajectory/alpha/corrected"));
}

TEST(ComparePage, SurvivesWhatIsNotFinite) {
  CompareReport r = report(true);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  r.robots[0].judged[5].pose.translation.x() = kNaN;
  r.robots[0].explanation.significance(3, 3) = std::numeric_limits<double>::infinity();
  r.robots[0].before.rmse_m = kNaN;
  const auto messages = test::messages_of(compare_html(r));
  EXPECT_TRUE(messages.at("trajectory/alpha/onboard").at("points").at(5).at(1).is_null());
  EXPECT_TRUE(json::accept(compare_json(r)));
}

}  // namespace compare_test
}  // namespace tutti::mission
