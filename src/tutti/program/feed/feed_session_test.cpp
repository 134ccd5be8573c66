// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_session.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/program/feed/session_fixture.hpp"

namespace tutti::program {
namespace feed_session_test {

using Feed = v1::Feed;
using FeedSessionTest = test::SessionFixture;

TEST_F(FeedSessionTest, AnswersHelloAndEverySample) {
  session_.connect(1);
  const auto greeting = say(1, test::hello());
  ASSERT_EQ(greeting.size(), 2U);
  EXPECT_EQ(greeting[0].welcome().robot_name(), "alpha");
  EXPECT_EQ(greeting[0].welcome().robot(), 4U);
  EXPECT_EQ(greeting[0].welcome().session(), 77U);
  EXPECT_FALSE(greeting[0].welcome().has_odometry());
  EXPECT_TRUE(greeting[1].has_situation());
  target_.known.wants_scan = true;
  target_.known.map_age = {2, 9};
  target_.known.covariance = 0.01 * Matrix6d::Identity();
  const auto answer = say(1, sample(10));
  ASSERT_EQ(answer.size(), 1U);
  const Feed::Correction& correction = answer[0].correction();
  EXPECT_EQ(correction.stamp_ns(), 10);
  EXPECT_EQ(correction.map_epoch(), 2U);
  EXPECT_EQ(correction.map_revision(), 9U);
  EXPECT_TRUE(correction.wants_scan());
  EXPECT_FALSE(correction.in_map());
  ASSERT_EQ(correction.t_map_odom_covariance_size(), 36);
  EXPECT_NEAR(correction.t_map_odom_covariance(7), 0.01, 1e-12);
  EXPECT_TRUE(say(1, test::scan({10}, 5)).empty());
  EXPECT_EQ(target_.scans.size(), 1U);
  EXPECT_FALSE(correction.has_stored());
  EXPECT_TRUE(say(1, test::end_of_recording())[0].has_ended());
  EXPECT_EQ(target_.finished, 1);
  EXPECT_EQ(say(1, sample(20))[0].refused().why(), "the recording has ended");
}

// The client's own odometry begins anew: its `odom` is another frame, and the body stays where it is.
TEST_F(FeedSessionTest, SaysWhereTheClientsOdometryIsAfterItBeganAnew) {
  const auto at = [](double x_m) { return Pose3{Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}; };
  const auto feed = [&](std::int64_t ns, double x_m) {
    return say(1, test::odometry({{ns}, at(x_m)}, Matrix6d::Identity()));
  };
  join(1);
  EXPECT_NEAR(feed(100, 20.0).at(0).correction().t_map_body().x(), 20.0, 1e-9);
  target_.known.T_odom_fed = at(20.0);
  target_.known.T_map_odom = at(20.0);
  const auto answer = feed(200, 0.0);
  ASSERT_EQ(answer.size(), 2U);
  EXPECT_NEAR(answer[0].jump().t_map_odom_from().x(), 0.0, 1e-9);
  EXPECT_NEAR(answer[0].jump().t_map_odom_to().x(), 20.0, 1e-9);
  EXPECT_EQ(answer[0].jump().translation_m(), 0.0);  // the body does not
  EXPECT_NE(answer[0].jump().why().find("began anew"), std::string::npos);
  EXPECT_NEAR(answer[1].correction().t_map_body().x(), 20.0, 1e-9);
  EXPECT_NEAR(answer[1].correction().t_map_odom().x(), 20.0, 1e-9);
  EXPECT_EQ(feed(300, 0.1).size(), 1U);  // reported once
}

TEST_F(FeedSessionTest, RefusesWhatIsNoGoodAndGoesOn) {
  join(1);
  EXPECT_TRUE(say(1, sample(10))[0].has_correction());
  const auto late = say(1, sample(10));
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(late[0].refused().stamp_ns(), 10);
  EXPECT_EQ(late[0].refused().why(), "stamps must increase");
  EXPECT_TRUE(say(1, test::scan({9}, 5))[0].has_refused());
  Feed half;
  half.mutable_odometry()->set_stamp_ns(11);
  EXPECT_TRUE(say(1, test::framed(half))[0].has_refused());
  EXPECT_FALSE(session_.is_over(1));
  EXPECT_TRUE(say(1, sample(12))[0].has_correction());
}

TEST_F(FeedSessionTest, ReportsLaterWhatTheRobotReportsLater) {
  join(1);
  join(2, true);
  target_.ends_at_once = false;
  target_.refusals = {{{5}, "too far"}};
  session_.refresh();
  const auto refused = read(1);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0].refused().why(), "too far");
  EXPECT_TRUE(read(2).empty());
  target_.known.stored = Timestamp{7};
  const auto answer = say(1, sample(8));
  EXPECT_TRUE(answer[0].correction().has_stored());
  EXPECT_EQ(answer[0].correction().stored_stamp_ns(), 7);
  EXPECT_TRUE(say(1, test::end_of_recording()).empty());
  EXPECT_TRUE(session_.waits_for_end(1));
  session_.refresh();
  EXPECT_TRUE(read(1).empty());
  target_.known.ended = true;
  session_.refresh();
  ASSERT_EQ(read(1).size(), 1U);
  EXPECT_FALSE(session_.waits_for_end(1));
  session_.refresh();
  EXPECT_TRUE(read(1).empty());
}

TEST_F(FeedSessionTest, ClosesAfterGarbage) {
  const std::string cut = test::framed({}).substr(0, 4);  // an empty message
  Feed from_robot;
  from_robot.mutable_ended();
  const std::vector<std::string> bad{std::string("\xff\xff\xff\xff", 4), std::string("\x02\0\0\0\xff\xff", 6), cut,
                                     test::framed(from_robot), test::hello()};
  FeedSession::Client client = 0;
  for (const std::string& bytes : bad) {
    join(++client);
    const auto answer = say(client, bytes);
    ASSERT_EQ(answer.size(), 1U);
    EXPECT_TRUE(answer[0].has_closed()) << client;
    EXPECT_TRUE(session_.is_over(client));
    EXPECT_FALSE(session_.has_feeder());  // so that the next may
    EXPECT_TRUE(say(client, sample(50)).empty());
  }
  EXPECT_FALSE(target_.known.newest.has_value());
  for (const std::string& first : {sample(1), test::hello(false, 2), test::end_of_recording()}) {
    session_.connect(++client);
    EXPECT_TRUE(say(client, first)[0].has_closed());
    EXPECT_TRUE(session_.is_over(client));
  }
}

TEST_F(FeedSessionTest, OneFeedsAndManyListen) {
  join(1);
  join(2, true);
  join(3, true);
  session_.receive(1, sample(10));
  for (const FeedSession::Client client : {1U, 2U, 3U}) EXPECT_EQ(read(client)[0].correction().stamp_ns(), 10);
  EXPECT_NE(say(2, sample(11))[0].closed().why().find("only listens"), std::string::npos);
  session_.connect(4);
  EXPECT_NE(say(4, test::hello())[0].closed().why().find("another client feeds"), std::string::npos);
  // It comes again where it stood, and what it sends again is refused.
  session_.disconnect(1);
  session_.connect(5);
  const auto greeting = say(5, test::hello());
  EXPECT_TRUE(greeting[0].welcome().has_odometry());
  EXPECT_EQ(greeting[0].welcome().last_stamp_ns(), 10);
  EXPECT_TRUE(say(5, sample(10))[0].has_refused());
  EXPECT_TRUE(say(5, sample(11))[0].has_correction());
  EXPECT_EQ(read(3).size(), 1U);
}

TEST_F(FeedSessionTest, ReportsWhatChangesOnce) {
  join(1);
  join(2, true);
  target_.known.component = 3;
  target_.known.team_mates = {{RobotId{8}, "bravo", {5}, Pose3{}}, {RobotId{9}, "charlie", {6}, std::nullopt}};
  target_.known.alerts = {{"odd", {1}, {2}, {3}}};
  session_.refresh();
  session_.refresh();
  for (const FeedSession::Client client : {1U, 2U}) {
    const auto heard = read(client);
    ASSERT_EQ(heard.size(), 1U);
    const Feed::Situation& situation = heard[0].situation();
    EXPECT_TRUE(situation.in_map());
    EXPECT_EQ(situation.component(), 3U);
    ASSERT_EQ(situation.team_mate_size(), 2);
    EXPECT_EQ(situation.team_mate(0).name(), "bravo");
    EXPECT_TRUE(situation.team_mate(0).same_component());
    EXPECT_FALSE(situation.team_mate(1).same_component());
    EXPECT_FALSE(situation.team_mate(1).has_t_map_body());
    ASSERT_EQ(situation.alert_size(), 1);
    EXPECT_EQ(situation.alert(0).until_stamp_ns(), 3);
  }
}

TEST_F(FeedSessionTest, AnnouncesAJumpBeforeItIsMade) {
  join(1);
  static_cast<void>(say(1, sample(10)));
  target_.known.T_map_odom.translation.x() = 5.0;
  target_.known.map_age = {1, 42};
  const auto answer = say(1, sample(20));
  ASSERT_EQ(answer.size(), 2U);
  EXPECT_EQ(answer[0].jump().stamp_ns(), 20);
  EXPECT_NEAR(answer[0].jump().translation_m(), 5.0, 1e-12);
  EXPECT_NE(answer[0].jump().why().find("revision 42"), std::string::npos);
  EXPECT_EQ(answer[0].jump().t_map_odom_to().x(), 5.0);
  EXPECT_EQ(answer[1].correction().t_map_odom().x(), 5.0);
}

TEST_F(FeedSessionTest, ASlowClientLosesOldCorrectionsAndNothingElse) {
  join(1);
  join(2, true);
  session_.receive(1, sample(1));
  session_.sent(2, 10);  // the first one has left in part
  for (std::int64_t ns = 2; ns <= 100; ++ns) {
    target_.known.T_map_odom.translation.x() = ns == 40 ? 5.0 : target_.known.T_map_odom.translation.x();
    EXPECT_GE(say(1, sample(ns)).size(), 1U);
  }
  EXPECT_FALSE(session_.is_over(2));
  std::string bytes(4, '\0');  // of which the ten that were sent count
  std::string rest;
  while (!session_.output(2).empty()) {
    const std::string_view part = session_.output(2);
    rest += part;
    session_.sent(2, part.size());
  }
  EXPECT_LE(rest.size(), 8192U);
  EXPECT_GT(rest.size(), 6000U);
  // The rest of the first, then the jump at 40, then the newest corrections.
  std::uint32_t first_size = static_cast<std::uint32_t>(test::framed({}).size());
  for (first_size = 0; first_size < rest.size(); ++first_size) {
    const auto whole = test::messages(std::string_view(rest).substr(first_size));
    if (whole.size() < 5 || !whole[0].has_jump()) continue;
    EXPECT_EQ(whole[0].jump().stamp_ns(), 40);
    for (std::size_t i = 1; i < whole.size(); ++i)
      EXPECT_EQ(whole[i].correction().stamp_ns(), 100 - static_cast<std::int64_t>(whole.size() - 1 - i));
    const auto next = say(1, sample(200));
    EXPECT_EQ(next.back().correction().dropped(), 0U);
    EXPECT_EQ(read(2).back().correction().dropped(), 100 - 1 - (whole.size() - 1));
    return;
  }
  FAIL() << "no jump in what was left";
}

TEST_F(FeedSessionTest, AClientThatLosesWhatItMustHaveIsDropped) {
  join(1);
  session_.receive(1, sample(1));
  for (int i = 0; i < 1000; ++i) session_.receive(1, sample(1));  // refused, and it never reads why
  EXPECT_TRUE(session_.is_over(1));
  EXPECT_TRUE(session_.output(1).empty());
}

/// {length, the first of its bytes} of a frame.
std::string beginning_of_frame(std::size_t size, std::size_t there) {
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(size >> (8 * i) & 0xffU);
  return out + std::string(there, '\0');
}

TEST_F(FeedSessionTest, OnlyWhoFeedsMayHoldALargeFrame) {
  join(0);
  join(1, true);
  session_.connect(2);  // sends no Hello
  const std::string begin = beginning_of_frame(kMaxFeedBytes, 1'000), small = beginning_of_frame(kMaxHelloBytes, 1'000);
  EXPECT_TRUE(say(0, begin).empty());
  for (const FeedSession::Client client : {1, 2}) {
    EXPECT_FALSE(session_.is_over(client));
    const auto heard = say(client, begin);
    ASSERT_EQ(heard.size(), 1U);
    EXPECT_EQ(heard[0].closed().why(), "a frame of 16777216 bytes, expected 1 to 65536 of a client that does not feed");
  }
  session_.connect(3);
  EXPECT_TRUE(say(3, small).empty());
  EXPECT_FALSE(session_.is_over(0));
}

TEST_F(FeedSessionTest, AFrameThatDoesNotGoOnIsClosed) {
  constexpr double kPause_s = FeedSession::kMostPause_s;
  join(0);
  join(1, true);
  session_.close_stalled(0.0);
  session_.close_stalled(10.0 * kPause_s);  // between frames any pause is right
  double now_s = 10.0 * kPause_s;
  session_.receive(0, beginning_of_frame(kMaxFeedBytes, 1));
  for (int i = 0; i < 5; ++i) {
    session_.close_stalled(now_s);
    session_.close_stalled(now_s += kPause_s);
    ASSERT_FALSE(session_.is_over(0)) << i;  // it goes on, slowly
    session_.receive(0, "x");
  }
  session_.close_stalled(now_s);
  EXPECT_TRUE(session_.has_feeder());
  session_.close_stalled(now_s += kPause_s + 1.0);
  EXPECT_TRUE(session_.is_over(0));
  EXPECT_FALSE(session_.is_over(1));
  EXPECT_FALSE(session_.has_feeder());
  EXPECT_FALSE(session_.output(0).empty());  // why
  session_.close_stalled(now_s += kPause_s + 1.0);
  EXPECT_TRUE(session_.output(0).empty());  // it does not read either
  join(2);
}

}  // namespace feed_session_test
}  // namespace tutti::program
