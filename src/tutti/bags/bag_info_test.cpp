// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_info.hpp"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "support/bags/bag_writer.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/mcap_reader.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_messages.hpp"

namespace tutti::bags {
namespace bag_info_test {

using namespace test;

BagInfo info_of(std::string bytes) {
  auto reader = McapReader::open(std::make_unique<std::istringstream>(std::move(bytes)), "bag");
  return inspect(reader.value());
}

TEST(BagInfo, SaysWhatIsThere) {
  const std::string definitions = schema(1, "nav_msgs/msg/Odometry") + channel(1, 1, "/odom") +
                                  schema(2, "std_msgs/msg/String") + channel(2, 2, "/talk") + channel(3, 1, "/silent");
  std::string data = kMagic + header() + definitions;
  for (std::uint64_t i = 0; i < 5; ++i) data += message(1, i * 500'000'000, odometry());
  data += message(2, 100, "hello");
  const BagInfo info = info_of(closed(data, definitions, 6));
  ASSERT_EQ(info.topics.size(), 3U);
  const TopicInfo& odom = info.topics[0];
  EXPECT_EQ(odom.topic, "/odom");
  EXPECT_EQ(odom.count, 5U);
  EXPECT_DOUBLE_EQ(odom.rate_hz(), 2.0);
  EXPECT_EQ(odom.frames, "odom -> base_link");
  EXPECT_EQ(info.topics[1].topic, "/silent");
  EXPECT_EQ(info.topics[1].count, 0U);
  EXPECT_EQ(info.topics[1].rate_hz(), 0.0);
  EXPECT_EQ(info.topics[2].frames, "");
  EXPECT_TRUE(info.notes.empty());
  const auto lines = uses(info);
  EXPECT_EQ(lines.at(0), "odometry     /odom (odom -> base_link)");
  EXPECT_TRUE(lines.at(1).starts_with("scans        none")) << lines.at(1);
}

TEST(BagInfo, EveryKnownTypeSaysItsFrame) {
  const std::map<std::string, std::pair<std::string, std::string>> of_type{
      {"nav_msgs/msg/Odometry", {odometry(), "odom -> base_link"}},
      {"sensor_msgs/msg/PointCloud2", {point_cloud(), "lidar"}},
      {"livox_ros_driver2/msg/CustomMsg", {livox(), "livox_frame"}},
      {"sensor_msgs/msg/Image", {image(), "camera"}},
      {"sensor_msgs/msg/CompressedImage", {compressed_image(), "camera"}},
      {"sensor_msgs/msg/CameraInfo", {camera_info(), "camera"}},
      {"sensor_msgs/msg/Imu", {imu(), "imu"}},
      {"sensor_msgs/msg/NavSatFix", {nav_sat_fix(), "gps"}},
      {"geometry_msgs/msg/PoseStamped", {pose_stamped(), "map"}},
      {"tf2_msgs/msg/TFMessage", {transforms(), "base -> lidar, base -> camera_left"}},
  };
  for (const auto& [type, expected] : of_type) {
    const auto& [bytes, frames] = expected;
    const BagInfo info = info_of(kMagic + schema(1, type) + channel(1, 1, "/a") + message(1, 1, bytes));
    EXPECT_EQ(info.topics.at(0).frames, frames) << info.topics.at(0).problem;
    const BagInfo cut = info_of(kMagic + schema(1, type) + channel(1, 1, "/a") + message(1, 1, bytes.substr(0, 9)));
    EXPECT_NE(cut.topics.at(0).problem.find(type), std::string::npos);
    EXPECT_EQ(cut.topics.at(0).count, 1U);
  }
}

TEST(BagInfo, StatisticsThatDisagreeAreNoted) {
  const std::string definitions = schema(1, "a/msg/B") + channel(1, 1, "/a");
  const BagInfo info = info_of(closed(kMagic + definitions + message(1, 1, ""), definitions, 9));
  EXPECT_EQ(info.notes, std::vector<std::string>{"its statistics say 9 messages, 1 could be read"});
}

/// A camera and three topics of depth: of its images, of other ones, and of none that is calibrated.
TEST(BagInfo, DepthIsNoCameraAndItsOwnIsNamed) {
  const std::string pixels(640 * 480 * 2, '\1');
  std::string data = kMagic;
  std::uint16_t id = 0;
  const auto add = [&](const std::string& topic, const char* type, const std::string& bytes) {
    ++id;
    data += schema(id, type) + channel(id, id, topic) + message(id, 1, bytes);
  };
  const auto add_images = [&](const std::string& name, const char* encoding, std::uint32_t width, bool has_info) {
    RosImage image{.header = {{1}, "optical"}, .height = 480, .width = width, .encoding = encoding};
    image.step = 2 * width;
    image.data = std::string_view(pixels).substr(0, std::size_t{2} * width * 480);
    add(name + "/image_raw", "sensor_msgs/msg/Image", encode(image));
    RosCameraInfo info{.header = image.header, .height = 480, .width = width};
    info.k = {500, 0, 320, 0, 500, 240, 0, 0, 1};
    if (has_info) add(name + "/camera_info", "sensor_msgs/msg/CameraInfo", encode(info));
  };
  const auto row_of = [&](const char* row) {
    for (const std::string& line : uses(info_of(data)))
      if (line.starts_with(row)) return line;
    return std::string("nothing");
  };
  add_images("/color", "mono8", 640, true);
  EXPECT_EQ(row_of("depth"), "nothing");
  add_images("/raw", "32FC1", 320, true);
  add_images("/bare", "16UC1", 640, false);
  EXPECT_EQ(row_of("images"), "images       /color/image_raw (optical)");
  EXPECT_EQ(
      row_of("depth"),
      "depth        /bare/image_raw (optical, 16UC1, 640 x 480, no CameraInfo); /raw/image_raw (optical, 32FC1, 320 "
      "x 480); no depth is used: none is registered to /color/image_raw: /raw/image_raw: 320 x 480 "
      "pixels, expected 640 x 480 as of /color/image_raw");
  add_images("/alone", "mono8", 640, false);
  EXPECT_EQ(
      row_of("images"),
      "images       /alone/image_raw (optical), of no use: /alone/image_raw: no sensor_msgs/CameraInfo beside it, "
      "expected on /alone/camera_info; /color/image_raw (optical)");
  add_images("/aligned", "16UC1", 640, true);
  EXPECT_TRUE(row_of("depth").ends_with("; /aligned/image_raw goes with /color/image_raw")) << row_of("depth");
  add_images("/second", "16UC1", 640, true);
  EXPECT_TRUE(
      row_of("depth").ends_with("2 topics are registered to /color/image_raw, /aligned/image_raw and "
                                "/second/image_raw; say which: tutti run --topic NAME.depth=/aligned/image_raw"))
      << row_of("depth");
}

/// A receiver with a fix now and then is of use; one without, or of which none is a fix, is not.
TEST(BagInfo, FixesThatAreNoneAreOfNoUse) {
  const auto fixes_row = [](const std::vector<RosNavSatFix>& fixes) {
    std::string data = kMagic + schema(1, "sensor_msgs/msg/NavSatFix") + channel(1, 1, "/fix");
    for (const RosNavSatFix& fix : fixes) data += message(1, 1, encode(fix));
    return uses(info_of(data)).at(3);
  };
  const RosNavSatFix good{.header = {{1}, "gps"}, .latitude_deg = 48.0, .longitude_deg = 11.0, .altitude_m = 500.0};
  RosNavSatFix none = good, e7 = good;
  none.status = -1;
  e7.latitude_deg *= 1e7;  // as some receivers' protocols have it
  EXPECT_EQ(fixes_row({none, e7, good}), "fixes        /fix (gps)");
  EXPECT_EQ(fixes_row({none, none}),
            "fixes        /fix (gps), of no use: no message has a fix (status -1, or 0 degrees "
            "north and 0 east)");
  const std::string refused = fixes_row({none, e7, e7});
  EXPECT_TRUE(
      refused.starts_with("fixes        /fix (gps), of no use: no message is a fix, the first because: message 2: "))
      << refused;
}

TEST(BagInfo, OneMoreOdometryOfARobotIsNoRobot) {
  const auto robots_of = [](const std::vector<std::pair<const char*, const char*>>& topics) {
    std::string data = kMagic + schema(1, "nav_msgs/msg/Odometry") + schema(2, "sensor_msgs/msg/PointCloud2");
    std::uint16_t id = 0;
    for (const auto& [topic, kind] : topics) data += channel(++id, *kind == 'o' ? 1 : 2, topic);
    return info_of(data).robots;
  };
  EXPECT_EQ(robots_of({{"/odom", "o"}, {"/wheel/odom", "o"}, {"/points", "s"}}), std::set<std::string>{});
  EXPECT_EQ(robots_of({{"/a/odom", "o"}, {"/b/odom", "o"}, {"/a/points", "s"}, {"/b/points", "s"}}),
            (std::set<std::string>{"a", "b"}));
  EXPECT_EQ(robots_of({{"/a/odom", "o"}, {"/b/odom", "o"}}), (std::set<std::string>{"a", "b"}));
}

TEST(BagInfo, RobotsAreNamedAndSoAreTheContradictionsOfTheirTransforms) {
  const auto transform = [](const std::string& parent, const std::string& child, double x) {
    const RosTransform out{
        .header = {{1}, parent}, .child_frame_id = child, .translation = {x, 0, 0}, .rotation = {1, 0, 0, 0}};
    return encode(std::span(&out, 1));
  };
  const std::string tf = "tf2_msgs/msg/TFMessage";
  std::string data = kMagic + schema(1, "nav_msgs/msg/Odometry") + schema(2, tf) + channel(1, 1, "/alpha/odom") +
                     channel(2, 2, "/tf") + channel(3, 2, "/charlie/tf") + channel(4, 2, "/tf_static");
  data += message(1, 1, odometry()) + message(2, 1, transform("bravo/odom", "bravo/base_link", 0.0)) +
          message(3, 1, transform("odom", "base_link", 0.0)) + message(4, 1, transform("base_link", "lidar", 0.0)) +
          message(4, 2, transform("base_link", "lidar", 2.0));
  const BagInfo info = info_of(data);
  EXPECT_EQ(uses(info).back(), "robots       alpha, bravo, charlie (namespaces with odometry)");
  ASSERT_EQ(info.notes.size(), 2U);
  EXPECT_NE(info.notes.back().find("transforms: frame 'lidar' in 'base_link' is static at [0.000 0.000 0.000] m and "
                                   "at [2.000 0.000 0.000] m, 2.000 m and 0.00 degrees apart"),
            std::string::npos)
      << info.notes.back();
}

TEST(BagInfo, WithoutOdometryThatIsReported) {
  EXPECT_EQ(uses(info_of(kMagic)).at(0), "odometry     missing: without odometry nothing can be made of this bag");
}

/// As in the SOURCES file of shared/data/mcap.
TEST(BagInfo, RealBagsHaveTheCountsOfTheirSources) {
  TUTTI_REQUIRE_SHARED("data/mcap");
  const std::map<std::string, std::uint64_t> of_file{
      {"nav2_turtlebot.mcap", 8197},           {"rosbag2/talker.mcap", 20},       {"rosbag2/wbag_0.mcap", 1246},
      {"rosbag2/multiple_files_0.mcap", 1324}, {"rosbag2/rewriter_b_0.mcap", 75}, {"rosbag2/cdr_test_0.mcap", 7}};
  for (const auto& [file, count] : of_file) {
    auto reader = McapReader::open(::tutti::test::shared_path("data/mcap/" + file).string());
    ASSERT_TRUE(reader) << reader.error().message;
    const BagInfo info = inspect(*reader);
    EXPECT_EQ(info.messages, count) << file;
    EXPECT_EQ(info.errors, 0U) << file << ": " << (info.said.empty() ? "" : info.said[0]);
    for (const TopicInfo& topic : info.topics) EXPECT_EQ(topic.problem, "") << file << " " << topic.topic;
  }
}

TEST(BagInfo, EveryMessageOfARealBagIsDecoded) {
  TUTTI_REQUIRE_SHARED("data/mcap");
  auto reader = McapReader::open(::tutti::test::shared_path("data/mcap/nav2_turtlebot.mcap").string()).value();
  std::map<std::string, std::uint64_t> counts;
  for (auto message = reader.next(); message && *message; message = reader.next()) {
    const BagMessage& one = **message;
    ++counts[one.channel->topic];
    if (use_of(one.channel->type) == Use::odometry) {
      const auto sample = decode_odometry(one.data);
      ASSERT_TRUE(sample) << sample.error().message;
      EXPECT_NEAR(sample->pose.orientation.norm(), 1.0, 1e-6);
    } else if (use_of(one.channel->type) == Use::transforms) {
      const auto transforms = decode_tf(one.data);
      ASSERT_TRUE(transforms) << transforms.error().message;
      for (const RosTransform& transform : *transforms) EXPECT_NEAR(transform.rotation.norm(), 1.0, 1e-6);
    }
  }
  EXPECT_EQ(counts, (std::map<std::string, std::uint64_t>{
                        {"/odom", 2639}, {"/tf", 5422}, {"/tf_static", 1}, {"/amcl_pose", 135}}));
}

/// Another writer's: 94 types, two messages of each; those that are known are decoded.
TEST(BagInfo, ABagOfAllTypesIsDecoded) {
  TUTTI_REQUIRE_SHARED("data/bags/all_types");
  std::string path;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(::tutti::test::shared_path("data/bags/all_types")))
    if (entry.path().extension() == ".mcap") path = entry.path().string();
  auto reader = McapReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  const BagInfo info = inspect(*reader);
  EXPECT_EQ(info.topics.size(), 94U);
  EXPECT_EQ(info.messages, 188U);
  std::size_t known = 0;
  for (const TopicInfo& topic : info.topics) {
    EXPECT_EQ(topic.problem, "") << topic.topic;
    known += topic.use != Use::nothing ? 1 : 0;
  }
  EXPECT_EQ(known, 11U);
}

}  // namespace bag_info_test
}  // namespace tutti::bags
