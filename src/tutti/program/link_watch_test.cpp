// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/link_watch.hpp"

#include <gtest/gtest.h>

namespace tutti::program {
namespace link_watch_test {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(LinkWatch, SaysOnceThatThereIsNoLinkAndThatItIsBack) {
  LinkWatch watch;
  bus::LinkState state{.url = "nats://base:4222", .last_error = "connecting: no server"};
  for (int s = 0; s < 5; ++s) EXPECT_TRUE(watch.check(state, s).empty()) << s;
  EXPECT_EQ(watch.trouble(), "");
  auto lines = watch.check(state, 5);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].level, Level::warning);
  EXPECT_TRUE(has(lines[0].sentence, "cannot reach the bus nats://base:4222: connecting: no server"))
      << lines[0].sentence;
  EXPECT_TRUE(watch.check(state, 50).empty());
  EXPECT_TRUE(has(watch.trouble(), "for 50 s")) << watch.trouble();
  state.connected = true;
  lines = watch.check(state, 60);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(has(lines[0].sentence, "is there, after 60 s")) << lines[0].sentence;
  EXPECT_EQ(watch.trouble(), "");
  state.connected = false;
  watch.check(state, 70);
  lines = watch.check(state, 76);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(has(lines[0].sentence, "lost its link to the bus")) << lines[0].sentence;
}

TEST(LinkWatch, TheAddressOfTheBusIsReportedOnce) {
  LinkWatch watch;
  const bus::LinkState state{.url = "nats://base:4222", .last_error = "nats://base:4222: connecting: no server"};
  watch.check(state, 0);
  const auto lines = watch.check(state, 5);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(has(lines[0].sentence, "cannot reach the bus nats://base:4222: connecting: no server"))
      << lines[0].sentence;
}

TEST(AnewWatch, ConnectsAnIdleWorkerAnewOnceAMinute) {
  AnewWatch watch;
  EXPECT_FALSE(watch.connects_anew(false, false, 1.0));
  EXPECT_FALSE(watch.connects_anew(true, true, 2.0));
  EXPECT_TRUE(watch.connects_anew(true, false, 3.0));
  for (double s = 4.0; s < 63.0; s += 1.0) EXPECT_FALSE(watch.connects_anew(true, false, s)) << s;
  EXPECT_FALSE(watch.connects_anew(false, false, 64.0));
  EXPECT_TRUE(watch.connects_anew(true, false, 65.0));
}

TEST(LinkWatch, ACutThatNobodyNoticesIsNotReported) {
  LinkWatch watch;
  bus::LinkState state{.url = "nats://base:4222", .connected = true};
  for (int s = 0; s < 100; ++s) {
    state.connected = s % 6 != 0;
    EXPECT_TRUE(watch.check(state, s).empty()) << s;
  }
}

TEST(LinkWatch, ABusThatStoresNothingIsReportedToBeFull) {
  LinkWatch watch;
  bus::LinkState state{.url = "nats://base:4222", .connected = true, .unconfirmed_s = 20.0};
  EXPECT_TRUE(watch.check(state, 0).empty());
  state.unconfirmed_s = 26.0;
  auto lines = watch.check(state, 6);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].level, Level::error);
  EXPECT_TRUE(has(lines[0].sentence, "its disk may be full")) << lines[0].sentence;
  state.unconfirmed_s = 40.0;
  EXPECT_TRUE(watch.check(state, 20).empty());
  EXPECT_TRUE(has(watch.trouble(), "nothing for 40 s")) << watch.trouble();
  state.unconfirmed_s = 0.0;
  EXPECT_EQ(watch.check(state, 21).size(), 1U);
  EXPECT_EQ(watch.trouble(), "");
  state.streams_made_anew = 4;
  state.last_error = "the bus had lost all";
  lines = watch.check(state, 22);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].sentence, "the bus had lost all");
  EXPECT_TRUE(watch.check(state, 23).empty());
}

TEST(LinkWatch, AWorkerThatSpeaksOfOthersJobsIsNamed) {
  LinkWatch watch;
  bus::LinkState state{.url = "nats://base:4222", .connected = true};
  EXPECT_TRUE(watch.check(state, 0).empty());
  state.strange_settlements = 40;
  state.strange_settler = 7;
  const auto lines = watch.check(state, 1);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(has(lines[0].sentence, "worker number 7")) << lines[0].sentence;
  EXPECT_TRUE(has(lines[0].sentence, "40 times")) << lines[0].sentence;
  for (int s = 2; s < 100; ++s) {
    state.strange_settlements += 10;
    EXPECT_TRUE(watch.check(state, s).empty()) << "said once";
    EXPECT_NE(watch.trouble(), "") << s;
  }
  watch.check(state, 160);
  EXPECT_EQ(watch.trouble(), "");
}

TEST(LinkWatch, JobsGivenInVainAndWhatTheBusDoesNotAllowAreAlerts) {
  LinkWatch watch;
  bus::LinkState state{.url = "nats://base:4222", .connected = true, .given_in_vain = 60};
  auto lines = watch.check(state, 0);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].level, Level::error);
  EXPECT_TRUE(has(watch.trouble(), "given to workers 60 times")) << watch.trouble();
  EXPECT_TRUE(watch.check(state, 1).empty());
  state.given_in_vain = 0;
  EXPECT_EQ(watch.check(state, 2).size(), 1U);
  EXPECT_EQ(watch.trouble(), "");
  state.denied = "Permissions Violation for Publish to \"mission.m.robot.3.submap\"";
  state.unconfirmed_s = 60.0;  // and its disk is not full
  lines = watch.check(state, 3);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].level, Level::error);
  EXPECT_TRUE(has(watch.trouble(), "mission.m.robot.3.submap")) << watch.trouble();
  EXPECT_TRUE(watch.check(state, 4).empty());
}

TEST(LinkWatch, JobsThatWaitWhileNoWorkerThatIsThereTakesOneAreTrouble) {
  bus::LinkState state{.url = "nats://base:4222", .connected = true, .jobs_untaken_s = 45.0};
  MissionStatus status{.time = Timestamp{} + 100.0};
  status.pending_jobs = 22;
  EXPECT_EQ(untaken_trouble(state, status), "") << "there is no worker: it says so elsewhere";
  status.workers.push_back({.number = 1, .last_seen = Timestamp{} + 98.0, .status = {}});
  EXPECT_TRUE(has(untaken_trouble(state, status), "jobs wait (22), workers are there (1), and for 45 s none"))
      << untaken_trouble(state, status);
  state.jobs_untaken_s = 12.0;
  EXPECT_EQ(untaken_trouble(state, status), "") << "one that has just given its job back rests for 10 s";
  state.jobs_untaken_s = 45.0;
  status.workers.front().last_seen = Timestamp{} + 10.0;
  EXPECT_EQ(untaken_trouble(state, status), "") << "it has ended";
}

}  // namespace link_watch_test
}  // namespace tutti::program
