// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/bag_play.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <thread>

#include "support/bus/nats_network.hpp"
#include "support/intake/messages.hpp"
#include "support/program/ros/loopback.hpp"
#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/ros_encode.hpp"

namespace tutti::ros {
namespace bag_play_test {

namespace fs = std::filesystem;
using intake::test::kPeriod, intake::test::kStart, intake::test::odometry, test::taken;

constexpr double kPatience_s = 20.0;
constexpr const char *kOdometry = "nav_msgs/msg/Odometry", *kTf = "tf2_msgs/msg/TFMessage";

class BagPlay : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  /// Odometry of ten samples, the odd ones in one bag and the even ones in another, and a transform in each.
  std::vector<std::string> write_bags() {
    std::vector<std::string> out;
    for (int part = 0; part < 2; ++part) {
      const fs::path folder = folder_ / std::to_string(part);
      auto bag = bags::BagWriter::create(folder.string()).value();
      for (int i = part; i < 10; i += 2) {
        const std::int64_t stamp = kStart + i * kPeriod;
        EXPECT_TRUE(bag.write("/odom", kOdometry, {stamp}, odometry(stamp, i)));
      }
      EXPECT_TRUE(bag.write("/tf", kTf, {kStart}, intake::test::transform(kStart, "odom", "base_link", {})));
      EXPECT_TRUE(bag.close());
      out.push_back(folder.string());
    }
    return out;
  }
  Result<BagPlayed> play(BagPlayOptions options) {
    options.say = [this](const std::string& text) { said_ += text + "\n"; };
    return ros::play(options, test::join_loopback(), stop_);
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("bag_play_" + std::to_string(getpid()));
  const std::shared_ptr<Participant> me_ = test::join_loopback();
  std::string said_;
  std::atomic<bool> stop_ = false;
};

TEST_F(BagPlay, SeveralBagsComeInTheOrderOfTimeBelowANamespace) {
  const auto odom = me_->reader("/r1/odom", kOdometry, test::kKeepAll, "").value();
  const auto tf = me_->reader("/tf", kTf, test::kKeepAll, "").value();
  const auto clock = me_->reader("/clock", "rosgraph_msgs/msg/Clock", test::kKeepAll, "").value();
  const auto played = play({.bags = write_bags(),
                            .name_space = "r1",
                            .wait_for = {"/r1/odom", "/tf"},
                            .delay_s = 0.0,
                            .rate = 10.0,
                            .clock = true});
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->messages, 12U);
  EXPECT_EQ(played->topics, 2U);
  EXPECT_NEAR(played->bag_s, 0.9, 1e-9);
  EXPECT_GE(played->wall_s, 0.09);
  std::vector<std::string> expected;
  for (int i = 0; i < 10; ++i) expected.push_back(odometry(kStart + i * kPeriod, i));
  EXPECT_TRUE(taken(*odom) == expected);  // bytes: not to be printed
  EXPECT_EQ(taken(*tf).size(), 2U);
  EXPECT_GE(taken(*clock).size(), 2U);
  EXPECT_EQ(said_, "");
}

TEST_F(BagPlay, TheClockGoesOnWhereTheBagHasNoMessages) {
  {
    auto bag = bags::RosWriter::create((folder_ / "gap.mcap").string()).value();
    for (const std::int64_t stamp : {kStart, kStart + 20 * kPeriod})
      EXPECT_TRUE(bag.write("/odom", kOdometry, {stamp}, odometry(stamp)));
    EXPECT_TRUE(bag.close());
  }
  const auto clock = me_->reader("/clock", "rosgraph_msgs/msg/Clock", test::kKeepAll, "").value();
  const auto played = play({.bags = {(folder_ / "gap.mcap").string()}, .delay_s = 0.0, .rate = 4.0, .clock = true});
  ASSERT_TRUE(played) << played.error().message;
  const std::vector<std::string> said = taken(*clock);
  EXPECT_GE(said.size(), 5U);  // 0.5 s of wall time: 20 on a machine with nothing else to do
  EXPECT_EQ(said.front(), bags::encode_clock({kStart}));
  std::int64_t before = 0;
  for (const std::string& cdr : said) {
    std::int32_t seconds = 0;
    std::uint32_t rest = 0;
    std::memcpy(&seconds, cdr.data() + 4, sizeof seconds);
    std::memcpy(&rest, cdr.data() + 8, sizeof rest);
    const std::int64_t now = 1'000'000'000LL * seconds + rest;
    EXPECT_GT(now, before);
    EXPECT_LE(now, kStart + 20 * kPeriod);
    before = now;
  }
}

TEST_F(BagPlay, OnlyTheTopicsThatAreAskedFor) {
  const auto played = play({.bags = write_bags(), .topics = {"/tf"}, .delay_s = 0.0, .rate = 1000.0});
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->messages, 2U);
}

TEST_F(BagPlay, WhatIsNotThereIsReported) {
  const auto why = [&](const BagPlayOptions& options) { return play(options).error().message; };
  const std::vector<std::string> bags = write_bags();
  EXPECT_NE(why({.bags = {"/nowhere.mcap"}}).find("/nowhere.mcap"), std::string::npos);
  EXPECT_EQ(why({.bags = bags, .wait_for = {"/points"}}),
            "--wait-for /points: not published, expected one of /odom, /tf");
  EXPECT_NE(why({.bags = bags, .name_space = "a b"}).find("is no name for ROS"), std::string::npos);
}

TEST_F(BagPlay, WhatCannotBePublishedIsLeftOutAndReported) {
  {
    auto bag = bags::RosWriter::create((folder_ / "odd.mcap").string()).value();
    EXPECT_TRUE(bag.write("/a-b", kOdometry, {kStart}, odometry(kStart)));
    EXPECT_TRUE(bag.write("/odom", kOdometry, {kStart}, "ab"));
    EXPECT_TRUE(bag.write("/odom", kOdometry, {kStart}, ""));
    EXPECT_TRUE(bag.write("/odom", kOdometry, {kStart}, odometry(kStart)));
    EXPECT_TRUE(bag.write("odom", kTf, {kStart}, odometry(kStart)));
    EXPECT_TRUE(bag.write_json("/numbers", "numbers", "{}", {kStart}, "{}"));
    EXPECT_TRUE(bag.close());
  }
  const auto odom = me_->reader("/odom", kOdometry, test::kKeepAll, "").value();
  const auto played = play({.bags = {(folder_ / "odd.mcap").string()}, .wait_for = {"odom"}, .delay_s = 0.0});
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->messages, 1U);
  EXPECT_EQ(taken(*odom).size(), 1U);
  for (const char* part : {"/a-b is not played: topic '/a-b': 'a-b' is no name for ROS",
                           "/odom: left out: a message of 2 bytes, expected 4 to",
                           "/odom is not played as tf2_msgs/msg/TFMessage: it is nav_msgs/msg/Odometry too",
                           "/numbers is not played: its messages are 'json' of type 'numbers'"})
    EXPECT_NE(said_.find(part), std::string::npos) << part << "\n" << said_;
}

TEST_F(BagPlay, StopsWhenAsked) {
  std::jthread stopper([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop_ = true;
  });
  const auto played = play({.bags = write_bags(), .wait_for = {"/odom"}});  // whom nobody subscribes
  ASSERT_TRUE(played) << played.error().message;
  EXPECT_EQ(played->messages, 0U);
}

}  // namespace bag_play_test
}  // namespace tutti::ros
