// SPDX-License-Identifier: BSD-3-Clause
// tutti's programs beside a participant that is configured as rmw_cyclonedds_cpp does it (2.2 of Jazzy, 1.3 of Humble),
// by ROS's settings: such a participant is this process. It is the network's, so programs without --insecure must hear
// it and be heard although they keep to this machine.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/nats_server.hpp"
#include "support/program/ros/loopback.hpp"
#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/children.hpp"

namespace tutti {
namespace ros_discovery_test {

namespace fs = std::filesystem;
using ros::Participant, ros::test::kKeepAll, ros::test::taken, test::within;

constexpr double kPatience_s = 60.0;
constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kPeriod = 5'000'000;  // 200 Hz
constexpr const char *kOdometry = "nav_msgs/msg/Odometry", *kPoints = "sensor_msgs/msg/PointCloud2",
                     *kTf = "tf2_msgs/msg/TFMessage";

/// A ROS's settings, as its middleware hands them to CycloneDDS in front of what CYCLONEDDS_URI says.
struct Setting {
  std::string name, configuration;
  friend std::ostream& operator<<(std::ostream& out, const Setting& setting) { return out << setting.name; }
};

std::string jazzy(bool multicast, const std::string& peers) {
  return fmt::format(
      "<CycloneDDS><Domain>{}<Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>{}</Discovery></Domain></CycloneDDS>,",
      multicast ? "" : "<General><AllowMulticast>false</AllowMulticast></General>",
      peers.empty() ? "" : "<Peers>" + peers + "</Peers>");
}
std::string peer(const std::string& address) { return "<Peer address=\"" + address + "\"/>"; }
std::string host_name() {
  std::array<char, 256> out{};
  gethostname(out.data(), out.size() - 1);
  return out.data();
}

// Settings that are configured alike share a name.
const std::vector<Setting> kHeard{
    {"JazzyWithNothingSetOrRangeSubnet", jazzy(true, "")},
    {"JazzyWithRangeLocalhostOrLocalhostOnly", jazzy(false, peer("localhost"))},
    {"JazzyWithStaticPeerLoopback", jazzy(true, peer("127.0.0.1"))},
    {"JazzyWithRangeLocalhostAndStaticPeerOfItsName", jazzy(false, peer("localhost") + peer(host_name()))},
    {"HumbleWithNothingSetOrJazzyWithRangeSystemDefault", ""},
    {"HumbleWithLocalhostOnly",
     "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces></General>"
     "</Domain></CycloneDDS>,"},
};

std::string off() {
  return fmt::format(
      "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>"
      "<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{}</Tag></Discovery></Domain></CycloneDDS>,",
      getpid());
}

class RosDiscovery : public ::testing::TestWithParam<Setting> {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    setenv("ROS_DOMAIN_ID", std::to_string(domain_).c_str(), 1);
  }
  void TearDown() override {
    children_.stop_all();
    fs::remove_all(folder_);
  }
  /// The ROS.
  std::shared_ptr<Participant> join(const std::string& configuration) {
    setenv("CYCLONEDDS_URI", configuration.c_str(), 1);
    auto out = Participant::open(domain_, ros::Reach::network);
    unsetenv("CYCLONEDDS_URI");
    return out.value();
  }
  void start(const std::string& name, std::vector<std::string> command) {
    command.insert(command.begin(), TUTTI_PROGRAM);
    ASSERT_TRUE(children_.start(name, command, folder_ / (name + ".txt")));
  }
  void start_robot(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{
        "robot", "--ros", "--name", "r1", "--bus", "nats://127.0.0.1:1", "--state", (folder_ / "r1").string()};
    command.insert(command.end(), more.begin(), more.end());
    start("robot", command);
  }
  [[nodiscard]] std::string output_of(const std::string& name) const {
    return name + ": " + read_file((folder_ / (name + ".txt")).string()).value_or("no output") + "\n";
  }

  const std::uint32_t domain_ = ros::test::free_domain();
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("ros_discovery_" + std::to_string(getpid()));
  lab::Children children_;
};

std::string odometry(std::int64_t i) {
  bags::RosOdometry out{.header = {{kStart + i * kPeriod}, "odom"}, .child_frame_id = "base_link"};
  out.pose.position.x() = 0.005 * static_cast<double>(i);
  return bags::encode(out);
}

/// A wall of 350,000 points, which are 4 MB.
std::string scan(std::int64_t i) {
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 350'000; ++k)
    points.emplace_back(5.0F, -5.0F + 0.01F * static_cast<float>(k % 1000), 0.01F * static_cast<float>(k / 1000));
  return bags::encode(bags::to_point_cloud({{kStart + i * kPeriod}, "lidar"}, points));
}

/// ROS's drivers are heard, and tutti's answers come back: one transform for each sample of odometry.
TEST_P(RosDiscovery, ARobotHearsAndIsHeard) {
  const auto ros = join(GetParam().configuration);
  const auto odom = ros->writer("/r1/odom", kOdometry, {.depth = 1000}, "").value();
  const auto points = ros->writer("/r1/points", kPoints, {.depth = 10}, "").value();
  const auto still = ros->writer("/tf_static", kTf, ros::kStaticTfQos, "").value();
  const auto tf = ros->reader("/tf", kTf, kKeepAll, "").value();
  const auto diagnostics = ros->reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", kKeepAll, "").value();
  const bags::RosTransform mount{.header = {{0}, "base_link"}, .child_frame_id = "lidar"};
  ASSERT_TRUE(still->write(bags::encode(std::span(&mount, 1))));
  start_robot({"--reliable"});
  ASSERT_TRUE(within(kPatience_s, [&] {
    return odom->readers() > 0 && points->readers() > 0 && still->readers() > 0 && tf->writers() > 0 &&
           diagnostics->writers() > 0;
  })) << output_of("robot");
  constexpr std::int64_t kSamples = 400, kScanEvery = 80;
  for (std::int64_t i = 0; i < kSamples; ++i) {
    if (i % kScanEvery == 0) {
      ASSERT_TRUE(points->write(scan(i)));
    }
    ASSERT_TRUE(odom->write(odometry(i)));
    usleep(kPeriod / 1000);
  }
  std::int64_t transforms = 0;
  bool are_scans_taken = false;
  EXPECT_TRUE(within(kPatience_s,
                     [&] {
                       ros->wait(0.05);
                       for (const std::string& cdr : taken(*tf)) {
                         const auto said = bags::decode_tf(cdr).value();
                         EXPECT_EQ(said.at(0).header.frame_id, "map");
                         EXPECT_EQ(said.at(0).header.stamp.ns, kStart + transforms++ * kPeriod + 100'000'000);
                       }
                       const std::string scans(
                           "scans\0\0\0\2\0\0\0"
                           "5",
                           13);
                       for (const std::string& cdr : taken(*diagnostics))
                         are_scans_taken = are_scans_taken || cdr.find(scans) != std::string::npos;
                       return transforms == kSamples && are_scans_taken;
                     }))
      << transforms << " of " << kSamples << ", " << are_scans_taken << output_of("robot");
}

/// A player and a server, too.
TEST_P(RosDiscovery, APlayerAndAServerAreHeard) {
  TUTTI_SKIP_WITHOUT_NATS_SERVER();
  const auto ros = join(GetParam().configuration);
  const auto odom = ros->reader("/r1/odom", kOdometry, kKeepAll, "").value();
  const auto map = ros->reader("/world/map", "nav_msgs/msg/OccupancyGrid", ros::kLatchedQos, "").value();
  const std::string bag = (folder_ / "bag.mcap").string();
  {
    auto writer = bags::RosWriter::create(bag).value();
    for (std::int64_t i = 0; i < 10; ++i)
      ASSERT_TRUE(writer.write("/r1/odom", kOdometry, {kStart + i * kPeriod}, odometry(i)));
    ASSERT_TRUE(writer.close());
  }
  start("play", {"bag", "play", bag, "--wait-for", "/r1/odom"});
  start("server", {"server", "--ros", "--state", (folder_ / "server").string()});
  std::size_t heard = 0;
  EXPECT_TRUE(within(kPatience_s,
                     [&] {
                       ros->wait(0.05);
                       heard += taken(*odom).size();
                       return heard == 10 && map->writers() == 1;
                     }))
      << heard << output_of("play") << output_of("server");
}

INSTANTIATE_TEST_SUITE_P(Of, RosDiscovery, ::testing::ValuesIn(kHeard),
                         [](const auto& setting) { return setting.param.name; });

using RosDiscoveryOff = RosDiscovery;

/// Who wants to be alone is; and why nothing is heard is said in the words of ROS.
TEST_P(RosDiscoveryOff, NothingIsHeardAndTheSettingIsNamed) {
  const auto ros = join(GetParam().configuration);
  const auto odom = ros->writer("/r1/odom", kOdometry, {}, "").value();
  start_robot();
  EXPECT_TRUE(within(kPatience_s, [&] {
    return output_of("robot").find("no odometry on /r1/odom for 5 s: nobody publishes it") != std::string::npos;
  })) << output_of("robot");
  EXPECT_NE(
      output_of("robot").find(fmt::format("ROS_DOMAIN_ID {} as here and whatever ROS_AUTOMATIC_DISCOVERY_RANGE or "
                                          "ROS_LOCALHOST_ONLY but OFF",
                                          domain_)),
      std::string::npos)
      << output_of("robot");
  EXPECT_EQ(odom->readers(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Of, RosDiscoveryOff, ::testing::Values(Setting{"JazzyWithRangeOff", off()}),
                         [](const auto& setting) { return setting.param.name; });

}  // namespace ros_discovery_test
}  // namespace tutti
