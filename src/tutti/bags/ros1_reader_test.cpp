// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros1_reader.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>

#include "support/bags/ros1_writer.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/ros_messages.hpp"

namespace tutti::bags {
namespace ros1_reader_test {

using namespace test;

struct Read {
  std::vector<std::string> messages;  ///< "topic type stamp data"
  std::vector<BagPosition> positions;
  std::vector<std::string> errors, notes;
};

Result<Ros1Reader> reader_of(std::string bytes) {
  return Ros1Reader::open(std::make_unique<std::istringstream>(std::move(bytes)), "bag");
}
std::string in_words(const BagMessage& message) {
  return fmt::format("{} {} {} {}", message.channel->topic, message.channel->type, message.log_time.ns, message.data);
}

Read read_all(const std::string& bytes) {
  Read out;
  auto reader = reader_of(bytes);
  if (!reader) return {{}, {}, {reader.error().message}, {}};
  while (true) {
    const auto message = reader->next();
    if (!message) {
      out.errors.push_back(message.error().message);
      continue;
    }
    if (!*message) break;
    out.messages.push_back(in_words(**message));
    out.positions.push_back((*message)->position);
  }
  out.notes = reader->notes();
  return out;
}

std::vector<Sample> samples() {
  std::vector<Sample> out;
  for (std::uint64_t i = 0; i < 9; ++i)
    out.push_back({i % 3 == 1 ? "/b" : "/a", i % 3 == 1 ? "pkg/msg/B" : "pkg/msg/A", 3'000'000'001 * i,
                   "data" + std::to_string(i)});
  return out;
}
std::vector<std::string> expected() {
  std::vector<std::string> out;
  for (const Sample& sample : samples())
    out.push_back(fmt::format("{} {} {} {}", sample.topic, sample.type, sample.ns, sample.data));
  return out;
}

class Ros1Bags : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(EveryCompression, Ros1Bags, ::testing::Values("none", "bz2", "lz4"));

TEST_P(Ros1Bags, AreReadInOrder) {
  const std::string whole = ros1_bag(samples(), GetParam(), 4);
  const Read read = read_all(whole);
  EXPECT_EQ(read.messages, expected());
  EXPECT_TRUE(read.errors.empty());
  EXPECT_TRUE(read.notes.empty());
  auto reader = reader_of(whole).value();
  EXPECT_EQ(reader.stated_messages(), 9U);
  EXPECT_EQ(reader.channels().size(), 2U);  // before any message was read
}

TEST_P(Ros1Bags, MessagesAreComeBackTo) {
  for (const bool closed : {true, false}) {
    const std::string bytes = ros1_bag(samples(), GetParam(), 4, closed);
    const Read read = read_all(bytes);
    EXPECT_EQ(read.notes.size(), closed ? 0U : 1U);
    ASSERT_EQ(read.messages, expected());
    auto reader = reader_of(bytes).value();
    for (const std::size_t i : {8, 1, 2, 0, 7, 3}) {
      ASSERT_TRUE(reader.seek(read.positions[i]));
      EXPECT_EQ(in_words(reader.next().value().value()), read.messages[i]);
    }
  }
}

TEST_P(Ros1Bags, CutAnywhereKeepWhatIsBeforeTheCut) {
  const std::string whole = ros1_bag(samples(), GetParam(), 4);
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); size += size < 4096 ? 97 : 1) {
    const Read read = read_all(whole.substr(0, size));
    const auto all = expected();
    ASSERT_TRUE(read.messages.size() <= all.size() &&
                std::equal(read.messages.begin(), read.messages.end(), all.begin()));
    ASSERT_GE(read.messages.size(), most) << size;  // a longer file never gives less
    most = read.messages.size();
    ASSERT_GE(read.notes.size() + read.errors.size(), 1U) << size;
  }
  EXPECT_EQ(most, 9U);
}

RC_GTEST_PROP(Ros1, FlippedBytesNeverCrash, ()) {
  std::string bytes = ros1_bag(samples(), *rc::gen::element<std::string>("none", "bz2", "lz4"), 4);
  const auto at = *rc::gen::inRange<std::size_t>(0, bytes.size());
  bytes[at] = static_cast<char>(bytes[at] ^ *rc::gen::inRange(1, 256));
  RC_ASSERT(read_all(bytes).messages.size() <= 9U);
}

TEST(Ros1, WhatIsWrongIsNamed) {
  const std::string first = "#ROSBAG V2.0\n" + ros1_bag_header(0) + ros1_connection(1, "/a", "pkg/A");
  const auto error_of = [&](const std::string& record) {
    const Read read = read_all(first + record + ros1_message(1, 5, "good"));
    EXPECT_EQ(read.messages.size(), 1U);  // what comes behind it is read
    return read.errors.size() == 1 ? read.errors[0] : fmt::format("{} errors", read.errors.size());
  };
  const std::string at = fmt::format("bag: byte {}: ", first.size());
  EXPECT_EQ(error_of(ros1_message(9, 1, "")), at + "message of connection 9, expected one that is defined before");
  EXPECT_EQ(error_of(ros1_connection(1, "/b", "pkg/A")),
            at + "connection 1 is '/b' (pkg/msg/A), expected '/a' (pkg/msg/A) as before");
  EXPECT_EQ(error_of(ros1_chunk("", "brotli")), at + "chunk: compression 'brotli', expected none, zstd, lz4 or bz2");
  EXPECT_EQ(error_of(ros1_record(2, {{"conn", "ab"}}, "")),
            at + "header of a record: conn: byte 0: conn wants 4 bytes, 2 are left");
  EXPECT_EQ(error_of(counted(counted("nonsense")) + counted("")),
            at + "header of a record: field 'nonsense' has no '='");
  std::string damaged = ros1_chunk(std::string(500, 'x'), "bz2");
  damaged[damaged.size() - 20] ^= 1;
  EXPECT_EQ(error_of(damaged).substr(0, at.size() + 11), at + "chunk: bz2:");
  EXPECT_NE(read_all("#ROSBAG V1.2\n").errors.at(0).find("expected '#ROSBAG V2.0'"), std::string::npos);
}

/// The independent reader of what is written here: ROS 1's own.
TEST(Ros1, ARealRosbagReadsWhatTestsWrite) {
  const char* const command = std::getenv("TUTTI_ROSBAG_INFO");
  if (command == nullptr) GTEST_SKIP() << "needs ROS 1's rosbag, which scripts/test_ros1.sh has";
  const std::string path = ::testing::TempDir() + "real_rosbag_" + std::to_string(getpid()) + ".bag";
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    write_bytes(path, ros1_bag(samples(), compression, 4));
    FILE* const pipe = popen(fmt::format("{} '{}' 2>&1", command, path).c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::string output(10'000, '\0');
    output.resize(fread(output.data(), 1, output.size(), pipe));
    EXPECT_EQ(pclose(pipe), 0) << output;
    for (const std::string& line :
         {fmt::format("compression: +{} \\[3/3 chunks", compression), std::string("messages: +9\n"),
          std::string("/a +6 msgs +: pkg/A"), std::string("/b +3 msgs +: pkg/B")})
      EXPECT_TRUE(std::regex_search(output, std::regex(line))) << line << "\n" << output;
  }
  std::filesystem::remove(path);
}

TEST(Ros1, EveryKnownTypeIsDecoded) {
  const std::map<std::string, std::string> of_type{
      {"nav_msgs/msg/Odometry", odometry("odom", "base_link", 2)},
      {"sensor_msgs/msg/PointCloud2", point_cloud(2)},
      {"livox_ros_driver2/msg/CustomMsg", livox(2)},
      {"livox_ros_driver/msg/CustomMsg", livox(2)},
      {"livox_interfaces/msg/CustomMsg", livox(2)},
      {"sensor_msgs/msg/Image", image(2)},
      {"sensor_msgs/msg/CompressedImage", compressed_image(2)},
      {"sensor_msgs/msg/CameraInfo", camera_info(2)},
      {"sensor_msgs/msg/Imu", imu(2)},
      {"sensor_msgs/msg/NavSatFix", nav_sat_fix(2)},
      {"geometry_msgs/msg/PoseStamped", pose_stamped(2)},
      {"tf2_msgs/msg/TFMessage", transforms(2)},
      {"tf/tfMessage", transforms(2)},
  };
  for (const auto& [type, bytes] : of_type)
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
      auto reader = reader_of(ros1_bag({{"/a", type, 1, bytes.substr(0, size)}}, "none")).value();
      const BagInfo info = inspect(reader);
      ASSERT_NE(info.topics.at(0).use, Use::nothing) << type;
      ASSERT_EQ(info.topics.at(0).problem.empty(), size == bytes.size()) << type << info.topics.at(0).problem;
    }
  const auto message = decode_odometry(of_type.at("nav_msgs/msg/Odometry"), RosEncoding::ros1).value();
  EXPECT_EQ(message.header.stamp.ns, 7'000'000'005);
  EXPECT_EQ(message.child_frame_id, "base_link");
  EXPECT_EQ(message.twist_covariance.back(), 235.0);
}

/// A real flight: visual-inertial odometry and a type that nobody here knows.
TEST(Ros1, ARealBagIsRead) {
  TUTTI_REQUIRE_SHARED("data/bags/flight_ros1");
  auto bag = open_bag(::tutti::test::shared_path("data/bags/flight_ros1/tag_detections.bag").string());
  ASSERT_TRUE(bag) << bag.error().message;
  const BagInfo info = inspect(**bag);
  EXPECT_EQ(info.errors, 0U) << info.said.at(0);
  EXPECT_TRUE(info.notes.empty()) << info.notes.at(0);
  EXPECT_EQ((*bag)->stated_messages(), info.messages);
  for (const TopicInfo& topic : info.topics) EXPECT_EQ(topic.problem, "") << topic.topic;
  bag = open_bag(::tutti::test::shared_path("data/bags/flight_ros1/tag_detections.bag").string());
  std::size_t poses = 0;
  for (auto message = (*bag)->next(); message && *message; message = (*bag)->next()) {
    if (use_of((*message)->channel->type) != Use::odometry) continue;
    const auto odometry = decode_odometry((*message)->data, RosEncoding::ros1);
    ASSERT_TRUE(odometry) << odometry.error().message;
    EXPECT_NEAR(odometry->pose.orientation.norm(), 1.0, 1e-6);
    ++poses;
  }
  EXPECT_GT(poses, 1000U);
}

TEST(Ros1, AChunkIsGivenUpAtItsFirstImpossibleRecord) {
  const std::string first = "#ROSBAG V2.0\n" + ros1_bag_header(0) + ros1_connection(1, "/a", "pkg/A");
  const std::string good = ros1_message(1, 5, "good");
  for (const std::string& impossible : {std::string(1'000'000, '\0'), counted(counted("nonsense")) + counted("")}) {
    const Read read = read_all(first + ros1_chunk(good + impossible + good, "bz2") + good);
    EXPECT_EQ(read.messages.size(), 2U);
    EXPECT_EQ(read.errors.size(), 1U);
  }
  std::string records;
  for (int i = 0; i < 100; ++i) records += ros1_message(9, 1, "") + ros1_connection(1, "/b", "pkg/A") + good;
  const Read read = read_all(first + ros1_chunk(records, "bz2") + ros1_chunk(records, "none"));
  EXPECT_EQ(read.messages.size(), 200U);
  EXPECT_EQ(read.errors.size(), 4U);  // the first of its kind in each
}

TEST(Ros1, ZerosBehindTheLastRecordAreOneError) {
  const Read read = read_all(ros1_bag(samples(), "none", 4, false) + std::string(1'000'000, '\0'));
  EXPECT_EQ(read.messages, expected());
  EXPECT_EQ(read.errors.size(), 1U);
}

}  // namespace ros1_reader_test
}  // namespace tutti::bags
