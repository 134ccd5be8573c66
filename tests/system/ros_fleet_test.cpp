// SPDX-License-Identifier: BSD-3-Clause
// Two robots whose navigation stacks drive by what Tutti publishes: in frames of their own names (alpha/odom), and as
// Nav2 lays a fleet out (frames odom and base_link for each, transforms in the robot's namespace).
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/nats_server.hpp"
#include "support/lab/ros_programs.hpp"
#include "support/program/ros/loopback.hpp"
#include "support/program/ros/tf_buffer.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/children.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/lab/write_bags.hpp"

namespace tutti {
namespace ros_fleet_test {

namespace fs = std::filesystem;
using ros::test::join_loopback, ros::test::kKeepAll, ros::test::taken, ros::test::TfBuffer, test::within;

constexpr double kPatience_s = 120.0;
constexpr const char *kTf = "tf2_msgs/msg/TFMessage", *kGrid = "nav_msgs/msg/OccupancyGrid";
constexpr const char* kSimulated = R"(
source: simulation
simulation:
  sensors: lidar
  lidar: {rays_share: 0.4}
  world: {kind: tunnel, network: {rows: 2, columns: 2, block_m: 10.0, jitter_m: 1.0}}
  robots:
    - {name: alpha, walk: {duration_s: 40}}
    - {name: bravo, walk: {duration_s: 40}}
odometry_hz: 20
closures: {verifier: lidar}
)";

/// A bag of a simulated robot, whose frames have its name, as one of a robot in Nav2's layout.
void write_as_nav2(const fs::path& from, const fs::path& to, const std::string& robot) {
  const auto own = [&](std::string& frame) {
    if (frame.starts_with(robot + "/")) frame = frame.substr(robot.size() + 1);
  };
  const auto bag = bags::open_bag(from.string()).value();
  auto out = bags::BagWriter::create(to.string()).value();
  for (auto message = bag->next().value(); message; message = bag->next().value()) {
    const auto& [topic, type] = std::tie(message->channel->topic, message->channel->type);
    std::string cdr(message->data), to_topic = topic;
    if (type == kTf) {
      auto transforms = bags::decode_tf(cdr).value();
      for (bags::RosTransform& one : transforms) own(one.header.frame_id), own(one.child_frame_id);
      cdr = bags::encode(transforms);
      to_topic = "/" + robot + topic;
    } else if (type == "nav_msgs/msg/Odometry") {
      auto odometry = bags::decode_odometry(cdr).value();
      own(odometry.header.frame_id), own(odometry.child_frame_id);
      cdr = bags::encode(odometry);
    } else if (type == "sensor_msgs/msg/PointCloud2") {
      auto cloud = bags::decode_point_cloud(cdr).value();
      own(cloud.header.frame_id);
      cdr = bags::encode(cloud);
    }
    ASSERT_TRUE(out.write(to_topic, type, message->log_time, cdr,
                          topic == "/tf_static" ? bags::Durability::latched : bags::Durability::volatile_));
  }
  ASSERT_TRUE(out.close());
}

/// The value of the cell under a point; nothing beyond the grid.
std::optional<int> cell_at(const bags::RosOccupancyGrid& grid, const Eigen::Vector3d& p) {
  const Eigen::Vector2d at = (p.head<2>() - grid.origin.position.head<2>()) / grid.resolution_m;
  if (at.minCoeff() < 0.0 || at.x() >= grid.width || at.y() >= grid.height) return std::nullopt;
  return grid.data[static_cast<std::size_t>(at.y()) * grid.width + static_cast<std::size_t>(at.x())];
}

/// The poses of a nav_msgs/Path, which is written only: each is a PoseStamped behind a sequence's length.
std::vector<Eigen::Vector3d> points_of(const std::string& path, std::string& frame) {
  const auto number = [&](std::size_t at) {
    std::uint32_t out = 0;
    std::memcpy(&out, path.data() + at, sizeof out);
    return out;
  };
  const auto aligned = [](std::size_t at, std::size_t size) { return 4 + (at - 4 + size - 1) / size * size; };
  std::size_t at = 4 + 8;
  const auto text = [&] {
    const std::uint32_t size = number(at);
    std::string out = path.substr(at + 4, size - 1);
    at = aligned(at + 4 + size, 4);
    return out;
  };
  frame = text();
  const std::uint32_t count = number(at);
  at += 4;
  std::vector<Eigen::Vector3d> out(count);
  for (Eigen::Vector3d& point : out) {
    at = aligned(at, 4) + 8;
    text();
    at = aligned(at, 8);
    std::memcpy(point.data(), path.data() + at, 3 * sizeof(double));
    at += 7 * sizeof(double);
  }
  return out;
}

class RosFleet : public ::testing::TestWithParam<bool>, protected ros::test::Programs {
 protected:
  RosFleet() : Programs("ros_fleet_", kPatience_s) {}
};

/// The grid and path of one robot's stack.
struct Stack {
  std::string prefix;  ///< Its frames begin with this.
  std::unique_ptr<ros::Reader> grid, path;
  std::string newest_grid, newest_path;
  std::size_t free = 0, poses = 0;
  std::string others;  ///< Those that are not on free cells.

  void look() {
    for (std::string& message : taken(*grid)) newest_grid = std::move(message);
    for (std::string& message : taken(*path)) newest_path = std::move(message);
    free = poses = 0;
    if (newest_grid.empty() || newest_path.empty()) return;
    const auto known = bags::decode_occupancy_grid(newest_grid).value();
    std::string frame;
    const auto points = points_of(newest_path, frame);
    EXPECT_EQ(known.header.frame_id, prefix + "map");
    EXPECT_EQ(frame, prefix + "map");
    poses = points.size();
    others.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::optional<int> cell = cell_at(known, points[i]);
      free += cell == 0 ? 1 : 0;
      if (cell != 0)
        others += fmt::format("; pose {} at {:.2f}, {:.2f}: {}", i, points[i].x(), points[i].y(),
                              cell ? std::to_string(*cell) : "beyond it");
    }
  }
};

TEST_P(RosFleet, EveryPoseOfARobotIsOnAFreeCellOfItsGridAndInOneTree) {
  TUTTI_SKIP_WITHOUT_NATS_SERVER();
  const bool is_nav2 = GetParam();
  ASSERT_TRUE(write_file((folder_ / "simulated.yaml").string(), kSimulated));
  ASSERT_TRUE(lab::write_bags(lab::load({.file = (folder_ / "simulated.yaml").string()}).value(), 1, folder_.string()));
  const auto participant = join_loopback();
  std::map<std::string, Stack> stacks;
  std::map<std::string, std::unique_ptr<ros::Reader>> tf;
  std::map<std::string, TfBuffer> buffers;
  std::vector<std::string> play{"bag", "play"};
  start("server", {"server", "--ros", "--map-period", "1", "--state", (folder_ / "server").string()});
  const std::string bus = bus_of("server");
  for (const std::string name : {"alpha", "bravo"}) {
    fs::path bag = folder_ / name;
    if (is_nav2) {
      bag = folder_ / ("nav2_" + name);
      write_as_nav2(folder_ / name, bag, name);
    }
    const std::string tf_topic = is_nav2 ? "/" + name + "/tf" : "/tf";
    Stack& stack = stacks[name];
    stack.prefix = is_nav2 ? "" : name + "/";
    stack.grid = participant->reader("/" + name + "/map", kGrid, ros::kLatchedQos, "").value();
    stack.path = participant->reader("/" + name + "/corrected_path", "nav_msgs/msg/Path", ros::kLatchedQos, "").value();
    if (!tf.contains(tf_topic)) tf[tf_topic] = participant->reader(tf_topic, kTf, kKeepAll, "").value();
    start(name, {"robot", "--ros", "--reliable", "--bus", bus, "--name", name, "--end-after", "2", "--stay", "--state",
                 (folder_ / ("of_" + name)).string(), "--set", "agent.submap.duration_s=6"});
    play.push_back(bag.string());
    play.insert(play.end(), {"--wait-for", "/" + name + "/points", "--wait-for", "/" + name + "/odom"});
  }
  start("play", play);
  const auto look = [&] {
    participant->wait(0.05);
    for (const auto& [topic, reader] : tf) buffers[topic].take(*reader);
    bool are_all_free = true;
    for (auto& [name, stack] : stacks) {
      stack.look();
      are_all_free = are_all_free && stack.poses > 50 && stack.free == stack.poses &&
                     buffers[is_nav2 ? "/" + name + "/tf" : "/tf"].find("world", stack.prefix + "base_link");
    }
    return are_all_free && output_of("play").find("messages of") != std::string::npos;
  };
  EXPECT_TRUE(within(kPatience_s, look)) << output_of("server") << output_of("alpha") << output_of("play");
  std::vector<std::string> worlds;
  for (const auto& [name, stack] : stacks) {
    fmt::print("{}: {} of {} poses are on free cells{}\n", name, stack.free, stack.poses, stack.others);
    EXPECT_EQ(stack.free, stack.poses) << name;
    const TfBuffer& buffer = buffers.at(is_nav2 ? "/" + name + "/tf" : "/tf");
    EXPECT_TRUE(buffer.find("world", stack.prefix + "base_link")) << name << output_of(name) << buffer.text();
    if (!is_nav2) {
      EXPECT_TRUE(buffer.find("world", "alpha/base_link") && buffer.find("world", "bravo/base_link"));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, RosFleet, ::testing::Bool(),
                         [](const auto& layout) { return layout.param ? "Nav2sLayout" : "PrefixedFrames"; });

}  // namespace ros_fleet_test
}  // namespace tutti
