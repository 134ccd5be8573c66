// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/history_routes.hpp"

#include <algorithm>
#include <fstream>

#include "support/program/page/served_page.hpp"

namespace tutti::page {
namespace history_routes_test {

using served::ask, served::json;
namespace fs = std::filesystem;

class PageHistory : public served::ServedPage {
 protected:
  /// The times of a key, as the past has them.
  std::vector<double> times_of(const std::string& key, const std::string& range = "") {
    const auto answer = client().Get("/api/history" + range);
    EXPECT_EQ(answer->status, 200) << answer->body;
    std::vector<double> out;
    const json all = json::parse(answer->body);
    for (const json& message : all.at("messages"))
      if (message.at("key") == key) out.push_back(message.at("t"));
    return out;
  }
  void show_statuses(double from_s, double until_s) {
    for (double time_s = from_s; time_s <= until_s; time_s += 2.0)
      viewer_->show_status(
          {.time = Timestamp{} + time_s,
           .revision = 3,
           .robots = {{.robot = RobotId{0}, .last_seen = Timestamp{} + 4.0, .status = {.name = "alpha"}}}});
    for (int i = 0; i < 1000 && known().at("first_s").is_null(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  json known() { return events().at("history"); }
};

TEST_F(PageHistory, AndThePageAreTheSameCompressedAndPlain) {
  start();
  auto http = client();
  for (const char* path : {"/", "/api/history"}) {
    const auto plain = http.Get(path), packed = http.Get(path, httplib::Headers{{"Accept-Encoding", "gzip"}});
    ASSERT_TRUE(plain && packed) << path;
    EXPECT_EQ(plain->get_header_value("Content-Encoding"), "") << path;
    EXPECT_EQ(packed->get_header_value("Content-Encoding"), "gzip") << path;
    EXPECT_EQ(packed->body, plain->body) << path;
    EXPECT_FALSE(plain->body.empty());
  }
  const auto head = http.Head("/");
  ASSERT_TRUE(head);
  EXPECT_GT(head->get_header_value<std::uint64_t>("Content-Length"), 100'000U);
  EXPECT_TRUE(head->body.empty());
}

TEST_F(PageHistory, IsThereAfterARestart) {
  start();
  events_with_map();
  show_statuses(6.0, 30.0);
  EXPECT_EQ(known().at("first_s"), 5.0);
  const auto before = events();
  restart();  // says 5 s once more, as of a clock that went back
  const auto after = events();
  for (const auto& [key, value] : before) {
    if (key == "status" || key == "alerts") continue;
    EXPECT_EQ(after.at(key), value) << key;
  }
  show_statuses(200.0, 206.0);
  for (int i = 0; i < 1000 && known().at("gaps").empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const std::vector<double> times = times_of("status");
  ASSERT_GE(times.size(), 3U) << json(times);
  EXPECT_EQ(times.front(), 5.0);
  // The second program's first status was 5 s once more, stored as a millisecond later: thinning keeps one of the two.
  const auto is_last_heard = [](double time_s) { return time_s == 30.0 || time_s == 30.001; };
  EXPECT_TRUE(std::ranges::any_of(times, is_last_heard)) << json(times);
  EXPECT_EQ(known().at("gaps").size(), 1U) << "from 30 s to 200 s";
  EXPECT_TRUE(std::ranges::is_sorted(times));
  const auto window = times_of("status", "?from=3&until=31");
  ASSERT_FALSE(window.empty());
  EXPECT_LT(window.back(), 31.0);
  EXPECT_EQ(client().Get("/api/history?from=x")->status, 400);
}

TEST_F(PageHistory, WhatOneOperatorAcknowledgesIsAcknowledgedForAll) {
  start();
  events_with_map();
  show_statuses(20.0, 22.0);
  const json silent = events().at("alerts").at(0);
  ASSERT_EQ(silent.at("id"), "robot/0/silent");
  EXPECT_EQ(ask(client(), "/api/acknowledge", {{"alerts", {"robot/7/silent"}}, {"by", "anna"}}).first, 409);
  EXPECT_EQ(ask(client(), "/api/acknowledge", {{"alerts", 7}}).first, 400);
  EXPECT_EQ(ask(client(), "/api/acknowledge", {{"alerts", {"robot/0/silent"}}}, {}).first, 403);
  EXPECT_EQ(ask(client(), "/api/acknowledge", {{"alerts", {"robot/0/silent"}}, {"by", "anna"}}).first, 200);
  const json said{{"alert", "robot/0/silent"}, {"since_s", 4.0}, {"by", "anna"}};
  EXPECT_EQ(events().at("acknowledged/robot/0/silent@4"), said);
  restart();
  EXPECT_EQ(events().at("acknowledged/robot/0/silent@4"), said) << "by a program that was started again, too";
  show_statuses(24.0, 26.0);
  EXPECT_EQ(ask(client(), "/api/acknowledge", {{"alerts", {"robot/0/silent"}}, {"undo", true}}).first, 200);
  EXPECT_TRUE(events().at("acknowledged/robot/0/silent@4").is_null());
}

/// Nothing that is wrong with the past stops the page.
TEST_F(PageHistory, ADamagedOneIsSetAside) {
  fs::create_directories(history_.parent_path());
  std::ofstream(history_) << "no history";
  start();
  events_with_map();
  EXPECT_TRUE(fs::exists(history_.string() + ".aside"));
  show_statuses(6.0, 8.0);
  EXPECT_EQ(known().at("first_s"), 5.0);
  EXPECT_EQ(known().at("trouble"), "");
}

}  // namespace history_routes_test
}  // namespace tutti::page
