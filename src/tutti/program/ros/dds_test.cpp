// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/dds.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "support/bus/nats_network.hpp"
#include "support/program/ros/loopback.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_encode.hpp"

namespace tutti::ros {
namespace dds_test {

using test::join_loopback, test::kKeepAll, test::taken, ::tutti::test::within;

constexpr double kPatience_s = 20.0;
constexpr const char* kOdometry = "nav_msgs/msg/Odometry";

std::string odometry(std::int64_t stamp_ns) {
  return bags::encode(bags::RosOdometry{.header = {{stamp_ns}, "odom"}, .child_frame_id = "base_link"});
}

TEST(Dds, BytesArriveAsTheyWereWritten) {
  const auto a = join_loopback(), b = join_loopback();
  const auto writer = a->writer("/alpha/odom", kOdometry, kKeepAll, bags::ros_type_hash(kOdometry)).value();
  const auto reader = b->reader("/alpha/odom", kOdometry, kKeepAll, "").value();
  ASSERT_TRUE(within(kPatience_s, [&] { return writer->readers() == 1 && reader->writers() == 1; }));
  std::vector<std::string> sent, got;
  for (int i = 0; i < 100; ++i) sent.push_back(odometry(i) + std::string(static_cast<std::size_t>(i) * 1000, 'x'));
  sent.push_back(odometry(0) + std::string(5'000'000, 'y'));
  for (const std::string& message : sent) ASSERT_TRUE(writer->write(message));
  ASSERT_TRUE(within(kPatience_s, [&] {
    b->wait(0.1);
    for (std::string& message : taken(*reader)) got.push_back(std::move(message));
    return got.size() == sent.size();
  })) << got.size();
  EXPECT_EQ(got, sent);
}

TEST(Dds, EveryTopicIsSeenWithTypeQosAndHash) {
  const auto a = join_loopback(), b = join_loopback();
  const auto odom = a->writer("/alpha/odom", kOdometry, kSensorQos, bags::ros_type_hash(kOdometry)).value();
  const auto still = a->writer("/tf_static", "tf2_msgs/msg/TFMessage", kStaticTfQos, "").value();
  const auto own = b->writer("/own", kOdometry, kSensorQos, "").value();
  ASSERT_TRUE(within(kPatience_s, [&] { return b->publications().size() == 2; }));
  std::map<std::string, Publication> seen;
  for (const Publication& publication : b->publications()) seen[publication.topic] = publication;
  EXPECT_EQ(seen["/alpha/odom"].type, kOdometry);
  EXPECT_EQ(seen["/alpha/odom"].user_data, "typehash=" + bags::ros_type_hash(kOdometry) + ";");
  EXPECT_FALSE(seen["/alpha/odom"].reliable);
  EXPECT_TRUE(seen["/tf_static"].reliable);
  EXPECT_TRUE(seen["/tf_static"].latched);
}

TEST(Dds, TheTopicsOfANavigationStackAreAllSeen) {
  const auto a = join_loopback(), b = join_loopback();
  constexpr std::size_t kEndpoints = 600;  // each node of ROS has some ten
  std::vector<std::unique_ptr<Writer>> writers;
  for (std::size_t i = 0; i < kEndpoints; ++i)
    writers.push_back(a->writer("/node" + std::to_string(i), kOdometry, kSensorQos, "").value());
  EXPECT_TRUE(within(kPatience_s, [&] { return b->publications().size() == kEndpoints; })) << b->publications().size();
  writers.resize(1);
  ASSERT_TRUE(within(kPatience_s, [&] { return b->publications().size() == 1; })) << b->publications().size();
  EXPECT_EQ(b->publications().front().topic, "/node0");
}

TEST(Dds, WhoComesLateIsGivenWhatIsLatched) {
  const auto a = join_loopback(), b = join_loopback();
  const auto writer = a->writer("/map", kOdometry, kLatchedQos, "").value();
  ASSERT_TRUE(writer->write(odometry(1)));
  ASSERT_TRUE(writer->write(odometry(2)));
  const auto reader = b->reader("/map", kOdometry, kLatchedQos, "").value();
  std::vector<std::string> got;
  ASSERT_TRUE(within(kPatience_s, [&] {
    for (std::string& message : taken(*reader)) got.push_back(std::move(message));
    return !got.empty();
  }));
  EXPECT_EQ(got, std::vector<std::string>{odometry(2)});
}

TEST(Dds, AQosThatDoesNotMatchIsReported) {
  const auto a = join_loopback(), b = join_loopback();
  const auto writer = a->writer("/odom", kOdometry, kSensorQos, "").value();
  const auto reader = b->reader("/odom", kOdometry, kLatchedQos, "").value();
  ASSERT_TRUE(within(kPatience_s, [&] { return !reader->incompatible().empty(); }));
  EXPECT_NE(reader->incompatible().find("1 publishers of /odom offer another reliability"), std::string::npos)
      << reader->incompatible();
  EXPECT_EQ(reader->writers(), 0U);
}

TEST(Dds, AReaderThatDoesNotTakeHoldsUpAReliableWriter) {
  const auto a = join_loopback(), b = join_loopback();
  const auto writer = a->writer("/odom", kOdometry, kKeepAll, "").value();
  const auto reader = b->reader("/odom", kOdometry, kKeepAll, "").value();
  ASSERT_TRUE(within(kPatience_s, [&] { return writer->readers() == 1 && reader->writers() == 1; }));
  constexpr int kSent = 5000;
  std::jthread sender([&] {
    for (int i = 0; i < kSent; ++i) ASSERT_TRUE(writer->write(odometry(i)));
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  int got = 0;
  ASSERT_TRUE(within(kPatience_s, [&] {
    b->wait(0.1);
    for (const std::string& message : taken(*reader)) EXPECT_EQ(message, odometry(got++));
    return got == kSent;
  })) << got;
}

TEST(Dds, NamesAreResolvedAsRosDoes) {
  EXPECT_EQ(resolve("odom", "alpha").value(), "/alpha/odom");
  EXPECT_EQ(resolve("odom", "/team/alpha").value(), "/team/alpha/odom");
  EXPECT_EQ(resolve("odom", "").value(), "/odom");
  EXPECT_EQ(resolve("odom", "/").value(), "/odom");
  EXPECT_EQ(resolve("/odom", "alpha").value(), "/odom");
  for (const char* topic : {"", "a//b", "2d", "a b", "odom/", "~x"})
    EXPECT_NE(resolve(topic, "alpha").error().message.find("is no name for ROS"), std::string::npos) << topic;
}

TEST(Dds, DomainsAreNumbers) {
  EXPECT_EQ(domain_of("").value(), 0U);
  EXPECT_EQ(domain_of("42").value(), 42U);
  for (const char* text : {"233", "-1", "7 ", "0x7", "seven", "99999999999"})
    EXPECT_NE(domain_of(text).error().message.find("from 0 to 232"), std::string::npos) << text;
}

TEST(Dds, WhatIsNoCdrIsNotSent) {
  const auto writer = join_loopback()->writer("/odom", kOdometry, kSensorQos, "").value();
  for (const std::string& bytes : {std::string(), std::string("\0\1\0", 3), std::string("\0\7\0\0", 4)})
    EXPECT_EQ(writer->write(bytes).error().code, ErrorCode::invalid);
  EXPECT_TRUE(writer->write(std::string("\0\1\0\0", 4)));
}

TEST(Dds, WhatIsNoTypeOfRosIsRefused) {
  EXPECT_NE(join_loopback()->writer("/odom", "Odometry", kSensorQos, "").error().message.find("'Odometry' is no type"),
            std::string::npos);
}

}  // namespace dds_test
}  // namespace tutti::ros
