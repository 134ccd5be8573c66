// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "support/bags/mcap_core.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/base/file.hpp"

namespace tutti::exports {
namespace scene_test {

namespace fs = std::filesystem;

Pose3 at(double x) { return {Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}}; }

/// One of everything, between `first` and a second later.
Scene scene(Timestamp first) {
  const Timestamp later = first + 1.0;
  const Trajectory trajectory{{first, at(1.0)}, {later, at(2.0)}};
  Scene out;
  out.tracks.push_back({"alpha/server", "world", trajectory});
  out.still.push_back({"world", "alpha/map", at(5.0)});
  out.motions.push_back({"alpha/map", "alpha/odom", trajectory});
  out.clouds.push_back({"map", "world", {{{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}}}});
  out.closures.push_back(
      {"alpha/0-bravo/1", "accepted", "", true, "world", later, {1, 0, 0}, {2, 0, 0}, {{"off_m", 0.5}}});
  out.closures.push_back(
      {"alpha/0-alpha/7", "rejected", "misfit \xff", false, "world", later, {1, 0, 0}, {3, 0, 0}, {{"off_m", 9.0}}});
  out.alerts.push_back({later, true, "alpha", "odometry failed", {{"off_m", "3"}}});
  out.numbers.push_back({"course", later, {{"closures_accepted", 3.0}, {"nothing", std::nan("")}}});
  return out;
}

fs::path file(const std::string& name) { return fs::path(::testing::TempDir()) / name; }

TEST(Scene, EverythingIsInTheFileAtItsTime) {
  const fs::path path = file("scene.mcap");
  const auto written = write_scene(scene(Timestamp{1'000'000'000'000}), path.string());
  ASSERT_TRUE(written) << written.error().message;
  const auto reader = bags::open_bag(path.string()).value();
  const bags::BagInfo info = bags::inspect(*reader);
  EXPECT_EQ(info.messages, written->messages);
  std::map<std::string, std::pair<std::string, std::uint64_t>> topics;
  for (const bags::TopicInfo& topic : info.topics) topics[topic.topic] = {topic.type, topic.count};
  EXPECT_EQ(topics, (std::map<std::string, std::pair<std::string, std::uint64_t>>{
                        {"/alpha/server", {"nav_msgs/msg/Path", 1}},
                        {"/alpha/server/pose", {"geometry_msgs/msg/PoseStamped", 2}},
                        {"/closures", {"tutti/msg/Closure", 2}},
                        {"/closures/accepted", {"visualization_msgs/msg/MarkerArray", 1}},
                        {"/closures/rejected", {"visualization_msgs/msg/MarkerArray", 1}},
                        {"/course", {"tutti/msg/NumbersCourse", 1}},
                        {"/diagnostics", {"diagnostic_msgs/msg/DiagnosticArray", 1}},
                        {"/map", {"sensor_msgs/msg/PointCloud2", 1}},
                        {"/tf", {"tf2_msgs/msg/TFMessage", 2}},
                        {"/tf_static", {"tf2_msgs/msg/TFMessage", 1}}}));
  const auto read = bags::test::read_with_mcap_core(path.string());
  if (!read) GTEST_SKIP() << bags::test::kNoMcapCore;
  EXPECT_EQ(read->size(), written->messages) << read->back();
  const auto has = [&](const std::string& line) { return std::ranges::find(*read, line) != read->end(); };
  EXPECT_TRUE(has(
      R"(/closures 1001000000000 {"name":"alpha/0-bravo/1","state":"accepted","reason":"","between_robots":true,"off_m":0.5})"));
  EXPECT_TRUE(has(R"(/course 1001000000000 {"closures_accepted":3})"));
}

/// rosbag2 plays no file with a channel that is not CDR, and no type that is not PACKAGE/msg/NAME.
TEST(Scene, ForRosAloneEverythingIsAMessageOfRos) {
  const fs::path path = file("ros_only.mcap");
  const auto written = write_scene(scene(Timestamp{1'000'000'000'000}), path.string(), true);
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(written->messages, write_scene(scene(Timestamp{1'000'000'000'000}), file("all.mcap").string())->messages);
  const auto reader = bags::open_bag(path.string()).value();
  for (const bags::TopicInfo& topic : bags::inspect(*reader).topics) {
    EXPECT_TRUE(bags::has_ros_definition(topic.type)) << topic.type;
    EXPECT_EQ(topic.problem, "") << topic.topic;
    if (topic.topic == "/course" || topic.topic == "/closures") {
      EXPECT_EQ(topic.type, "diagnostic_msgs/msg/DiagnosticArray");
    }
  }
  const std::string bytes = read_file(path.string()).value();
  for (const char* text : {"jsonschema", "tutti/msg"}) EXPECT_EQ(bytes.find(text), std::string::npos) << text;
}

TEST(Scene, StampsBefore1970AreMovedTogether) {
  const fs::path path = file("early.mcap");
  ASSERT_TRUE(write_scene(scene(Timestamp{-5'000'000'000}), path.string()));
  const auto reader = bags::open_bag(path.string()).value();
  for (const bags::TopicInfo& topic : bags::inspect(*reader).topics) EXPECT_GE(topic.first.ns, 0) << topic.topic;
}

TEST(Scene, NothingIsAnError) {
  EXPECT_FALSE(write_scene({}, file("none.mcap").string()));
  EXPECT_FALSE(fs::exists(file("none.mcap")));
}

TEST(Scene, NamesAreRoss) {
  EXPECT_EQ(ros_name("alpha.2"), "alpha_2");
  EXPECT_EQ(ros_name("7"), "robot_7");
  EXPECT_EQ(ros_name(""), "robot_");
}

}  // namespace scene_test
}  // namespace tutti::exports
