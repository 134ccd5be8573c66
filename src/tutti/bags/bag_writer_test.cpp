// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_writer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "support/bags/bag_writer.hpp"
#include "support/bags/mcap_core.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/file.hpp"

namespace tutti::bags {
namespace bag_writer_test {

namespace fs = std::filesystem;

TEST(BagWriter, FolderAndMetadataAreRosbag2s) {
  const fs::path folder = fs::path(::testing::TempDir()) / "bag_writer" / "alpha";
  fs::remove_all(folder);
  auto bag = BagWriter::create(folder.string()).value();
  RosOdometry odometry;
  odometry.header = {Timestamp{5'000'000'000}, "odom"};
  odometry.child_frame_id = "base_link";
  ASSERT_TRUE(bag.write("/odom", "nav_msgs/msg/Odometry", odometry.header.stamp, encode(odometry)));
  const RosTransform still{.header = {Timestamp{4'000'000'000}, "base_link"}, .child_frame_id = "lidar"};
  ASSERT_TRUE(bag.write("/tf_static", "tf2_msgs/msg/TFMessage", still.header.stamp, encode(std::span(&still, 1)),
                        Durability::latched));
  ASSERT_TRUE(bag.close());
  const auto reader = open_bag(folder.string()).value();
  const BagInfo info = inspect(*reader);
  ASSERT_EQ(info.topics.size(), 2U);
  EXPECT_EQ(info.topics[0].frames, "odom -> base_link");
  EXPECT_EQ(info.topics[1].frames, "base_link -> lidar");
  EXPECT_TRUE(info.notes.empty());
  const std::string metadata = read_file((folder / "metadata.yaml").string()).value();
  for (const char* line : {"  storage_identifier: mcap\n", "  duration:\n    nanoseconds: 1000000000\n",
                           "    nanoseconds_since_epoch: 4000000000\n", "  message_count: 2\n",
                           "        name: /tf_static\n        type: tf2_msgs/msg/TFMessage\n",
                           "            durability: 1\n", "    - alpha_0.mcap\n"})
    EXPECT_NE(metadata.find(line), std::string::npos) << line << "is not in\n" << metadata;
  EXPECT_EQ(BagWriter::create(folder.string()).error().code, ErrorCode::io);  // nothing is overwritten
  fs::remove_all(folder.parent_path());
}

/// Every type that is written, by other people's readers: of the file, of the definitions in it, and of the messages.
TEST(BagWriter, OthersReadWhatIsWritten) {
  const fs::path path = fs::path(::testing::TempDir()) / "others_read.mcap";
  for (const bool zstd : {true, false}) {
    auto bag = RosWriter::create(path.string(), {.zstd = zstd, .chunk_bytes = 500}).value();
    const Timestamp stamp{7'000'000'005};
    const auto write = [&](const std::string& topic, const std::string& type, const std::string& cdr) {
      ASSERT_TRUE(bag.write(topic, type, stamp, cdr));
    };
    write("/odometry", "nav_msgs/msg/Odometry", test::odometry());
    write("/tf", "tf2_msgs/msg/TFMessage", test::transforms());
    write("/cloud", "sensor_msgs/msg/PointCloud2", test::point_cloud());
    write("/imu", "sensor_msgs/msg/Imu", test::imu());
    write("/image", "sensor_msgs/msg/Image", test::image());
    write("/jpeg", "sensor_msgs/msg/CompressedImage", test::compressed_image());
    write("/camera", "sensor_msgs/msg/CameraInfo", test::camera_info());
    write("/fix", "sensor_msgs/msg/NavSatFix", test::nav_sat_fix());
    write("/pose", "geometry_msgs/msg/PoseStamped", test::pose_stamped());
    const RosPath way{.header = {stamp, "map"}, .poses = {{{stamp, "map"}, {{1, 2, 3}}}}};
    write("/way", "nav_msgs/msg/Path", encode(way));
    const std::array lines{RosLines{.header = {stamp, "map"}, .name_space = "closures", .id = 5, .points = {{1, 2, 3}}},
                           RosLines{.header = {stamp, "map"}, .id = 6}};
    write("/lines", "visualization_msgs/msg/MarkerArray", encode(lines));
    const RosDiagnostic fine{.level = 1, .name = "alpha", .message = "all", .values = {{"key", "value"}}};
    write("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", encode({stamp, "map"}, std::span(&fine, 1)));
    const std::array<std::int8_t, 3> cells{-1, 0, 100};
    write("/grid", "nav_msgs/msg/OccupancyGrid",
          encode(
              RosOccupancyGrid{.header = {stamp, "map"}, .resolution_m = 0.5, .width = 3, .height = 1, .data = cells}));
    const RosBall ball{.header = {stamp, "map"}, .name_space = "mates", .name = "bravo", .pose = {{1, 2, 3}}};
    write("/balls", "visualization_msgs/msg/MarkerArray", encode(ball.header, std::span(&ball, 1)));
    RosPoseWithCovariance sure{.header = {stamp, "map"}, .pose = {{4, 5, 6}}};
    sure.covariance[35] = 9.0;
    write("/sure", "geometry_msgs/msg/PoseWithCovarianceStamped", encode(sure));
    write("/clock", "rosgraph_msgs/msg/Clock", encode_clock(stamp));
    ASSERT_TRUE(bag.close());
    const auto read = test::read_with_mcap_core(path.string());
    if (!read) GTEST_SKIP() << test::kNoMcapCore;
    ASSERT_EQ(read->size(), 16U) << read->back();
    const auto expect = [&](std::size_t i, const std::string& begin, const std::string& part) {
      const std::string& line = read->at(i);
      EXPECT_TRUE(line.starts_with(begin + " 7000000005 {")) << line;
      EXPECT_NE(line.find(part), std::string::npos) << line;
    };
    expect(0, "/odometry", R"("position":{"x":1,"y":2,"z":3},"orientation":{"x":4,"y":5,"z":6,"w":7}})");
    expect(1, "/tf", R"("child_frame_id":"camera_left","transform":{"translation":{"x":8,"y":9,"z":10})");
    expect(2, "/cloud", R"({"name":"time","offset":4,"datatype":8,"count":1}],"is_bigendian":false,"point_step":12)");
    expect(3, "/imu", R"("angular_velocity":{"x":20,"y":21,"z":22})");
    expect(4, "/image", R"("encoding":"mono8","is_bigendian":0,"step":3,"data":[97,98,99])");
    expect(5, "/jpeg", R"("format":"jpeg","data":[255,216])");
    expect(6, "/camera", R"("binning_y":2,"roi":{"x_offset":3)");
    expect(7, "/fix", R"("status":{"status":-1,"service":3},"latitude":47)");
    expect(8, "/pose", R"("header":{"stamp":{"sec":7,"nanosec":5},"frame_id":"map"},"pose":)");
    expect(9, "/way",
           R"("poses":[{"header":{"stamp":{"sec":7,"nanosec":5},"frame_id":"map"},"pose":{"position":{"x":1)");
    expect(10, "/lines", R"("ns":"closures","id":5,"type":5,"action":0)");
    expect(10, "/lines", R"("points":[{"x":1,"y":2,"z":3}],"colors":[],"texture_resource":"")");
    expect(10, "/lines", R"("ns":"","id":6,"type":5)");
    expect(11, "/diagnostics",
           R"("level":1,"name":"alpha","message":"all","hardware_id":"","values":[{"key":"key","value":"value"}])");
    expect(12, "/grid", R"("resolution":0.5,"width":3,"height":1,"origin":{"position":{"x":0)");
    expect(12, "/grid", R"("data":[-1,0,100]})");
    expect(13, "/balls", R"("ns":"","id":0,"type":0,"action":3)");
    expect(13, "/balls", R"("ns":"mates","id":0,"type":2,"action":0,"pose":{"position":{"x":1,"y":2,"z":3})");
    expect(13, "/balls", R"("text":"bravo")");
    expect(14, "/sure", R"("position":{"x":4,"y":5,"z":6})");
    expect(14, "/sure", "0,0,0,9]}}");
    expect(15, "/clock", R"({"clock":{"sec":7,"nanosec":5}})");
  }
  fs::remove(path);
}

}  // namespace bag_writer_test
}  // namespace tutti::bags
