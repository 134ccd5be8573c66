// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace alerts_test {

MissionStatus status_at(double time_s, double seen_s) {
  MissionStatus status{.time = Timestamp{} + time_s};
  status.revision = 3;
  status.robots.push_back({.robot = RobotId{4},
                           .last_seen = Timestamp{} + seen_s,
                           .last_update = Timestamp{} + seen_s,
                           .submaps = 9,
                           .status = {.name = "echo"}});
  return status;
}

const Alert* find(const std::vector<Alert>& alerts, const std::string& id) {
  const auto found = std::ranges::find(alerts, id, &Alert::id);
  return found == alerts.end() ? nullptr : &*found;
}

TEST(Alerts, ARobotThatAgreesAndIsHeardIsNone) { EXPECT_TRUE(Alerts().of_status(status_at(100.0, 98.0)).empty()); }

TEST(Alerts, ASilentRobotIsSilentSinceItWasHeard) {
  Alerts alerts;
  for (const double now_s : {120.0, 150.0}) {
    const auto found = alerts.of_status(status_at(now_s, 98.0));
    ASSERT_EQ(found.size(), 1U) << now_s;
    EXPECT_EQ(found.front().id, "robot/4/silent");
    EXPECT_EQ(found.front().since_s, 98.0);
    EXPECT_EQ(found.front().where, "echo");
    EXPECT_EQ(found.front().robot, RobotId{4});
    EXPECT_FALSE(found.front().todo.empty());
  }
  MissionStatus finished = status_at(150.0, 98.0);
  finished.robots.front().status.finished = true;
  EXPECT_TRUE(alerts.of_status(finished).empty()) << "who has finished need not speak";
}

/// Statuses come by the wall clock: at four times its speed one that was late by half a second is 10 s of mission old.
TEST(Alerts, AMissionThatIsPlayedFasterWaitsAsMuchLonger) {
  Alerts alerts(silent_after_s(4.0));
  EXPECT_TRUE(alerts.of_status(status_at(110.0, 98.0)).empty());
  EXPECT_EQ(alerts.of_status(status_at(150.0, 98.0)).size(), 1U);
  EXPECT_EQ(silent_after_s(0.5), silent_after_s(1.0)) << "played slowly, statuses come as often";
}

TEST(Alerts, EveryTroubleIsReportedWithWhenItBegan) {
  Alerts alerts;
  MissionStatus status = status_at(100.0, 99.0);
  MissionStatus::Robot& robot = status.robots.front();
  robot.status.trouble = "no scans for 20 s";
  robot.status.alerts = 2;
  robot.status.backlog_submaps = 40;
  robot.status.health.battery_percent = 12.0;
  robot.conflict = "two programs";
  robot.refused = 1;
  robot.unread = 1;
  robot.last_update = std::nullopt;
  robot.status.heard_revision = 0;
  status.trouble = "the bus does not run";
  status.waiting = 3;
  status.pending_jobs = 1000;
  const auto first = alerts.of_status(status);
  for (const char* id :
       {"robot/4/trouble", "robot/4/drift", "robot/4/backlog", "robot/4/battery", "robot/4/conflict", "robot/4/refused",
        "robot/4/unread", "robot/4/uncorrected", "server/trouble", "server/waiting", "server/jobs"}) {
    ASSERT_NE(find(first, id), nullptr) << id;
    EXPECT_EQ(find(first, id)->since_s, 100.0) << id;
  }
  EXPECT_EQ(first.front().severity, Severity::error) << "what is worst comes first";
  EXPECT_EQ(first.back().severity, Severity::info);
  status.time = status.time + 50.0;
  status.robots.front().last_seen = status.time;
  status.robots.front().status.health.battery_percent = 80.0;
  const auto second = alerts.of_status(status);
  EXPECT_EQ(find(second, "robot/4/battery"), nullptr) << "what is over is gone";
  ASSERT_NE(find(second, "server/trouble"), nullptr);
  EXPECT_EQ(find(second, "server/trouble")->since_s, 100.0) << "and what lasts keeps its beginning";
}

/// A large map is made less often (node::UpdatePacer), and robots hear of it as much later.
TEST(Alerts, OfALargeMapARobotMayHearLater) {
  MissionStatus status = status_at(1000.0, 999.0);
  status.robots.front().last_update = status.time - 400.0;
  status.robots.front().status.heard_revision = status.revision - 1;
  EXPECT_EQ(Alerts().of_status(status).front().id, "robot/4/uncorrected");
  status.submaps = 10'000;  // may take 600 s
  EXPECT_TRUE(Alerts().of_status(status).empty());
  status.robots.front().last_update = status.time - 700.0;
  EXPECT_EQ(Alerts().of_status(status).front().id, "robot/4/uncorrected");
}

/// A hundred robots were told that their way down was cut, while an update of the map took the server 16 minutes.
TEST(Alerts, WhoUsesTheNewestMapIsNotBlamedForItsAge) {
  MissionStatus status = status_at(1000.0, 999.0);
  status.robots.front().last_update = status.time - 400.0;
  status.robots.front().status.heard_revision = status.revision;
  EXPECT_TRUE(Alerts().of_status(status).empty()) << "nothing has come since";
  status.robots.front().status.heard_epoch = status.epoch + 1;  // of a server with another map
  EXPECT_EQ(Alerts().of_status(status).front().id, "robot/4/uncorrected");
  status.robots.front().status.heard_epoch = status.epoch;
  status.has_news = true;
  const auto found = Alerts().of_status(status);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().id, "server/late");
  EXPECT_EQ(found.front().since_s, 600.0);
}

TEST(Alerts, AMapShowsWhoIsAlone) {
  storage::MemoryStore store{storage::map_schema()};
  mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, store);
  mapper.walk({RobotId{0}, 5});
  mapfile::ShownMap shown;
  shown.content = mapfile::read(store).value();
  shown.content.verdicts.clear();
  shown.map = mapfile::estimate(shown.content);
  shown.time = Timestamp{} + 10.0;
  Alerts alerts;
  EXPECT_EQ(find(alerts.of_map(shown, closures_holding(shown.content.submaps, shown.map)), "map/0/alone"), nullptr);
  mapper.walk({RobotId{1}, 5});
  shown.content = mapfile::read(store).value();
  shown.content.verdicts.clear();  // nothing joins them
  shown.content.names = {{RobotId{1}, "bravo"}, {RobotId{0}, "alpha"}};
  shown.map = mapfile::estimate(shown.content);
  const auto apart = alerts.of_map(shown, closures_holding(shown.content.submaps, shown.map));
  const Alert* alone = find(apart, "map/1/alone");
  if (alone == nullptr) alone = find(apart, "map/0/alone");
  ASSERT_NE(alone, nullptr);
  EXPECT_EQ(alone->where, alone->robot == RobotId{1} ? "bravo" : "alpha");
}

TEST(Alerts, WhatTroublesTheServerIsAnError) {
  MissionStatus status = status_at(100.0, 99.0);
  status.trouble = "jobs wait (22), workers are there (1), and for 45 s none has taken one";
  const auto found = Alerts().of_status(status);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().id, "server/trouble");
  EXPECT_EQ(found.front().severity, Severity::error);
  EXPECT_EQ(found.front().what, status.trouble);
}

}  // namespace alerts_test
}  // namespace tutti::page
