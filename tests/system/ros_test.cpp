// SPDX-License-Identifier: BSD-3-Clause
// Programs that talk as ROS 2 does, over DDS on loopback: bags played, robots and a server that map from them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/nats_server.hpp"
#include "support/lab/ros_programs.hpp"
#include "support/paths.hpp"
#include "support/program/ros/loopback.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/internal/cursor.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/file.hpp"
#include "tutti/intake/ros_intake.hpp"
#include "tutti/lab/children.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/lab/write_bags.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/program/server_program.hpp"

namespace tutti {
namespace ros_test {

namespace fs = std::filesystem;
using ros::test::join_loopback, ros::test::kKeepAll, ros::test::taken, test::within;

constexpr double kPatience_s = 60.0;  // a busy machine

class Ros : public ::testing::Test, protected ros::test::Programs {
 protected:
  Ros() : Programs("ros_", kPatience_s) {}
  /// All of them, each with exit code 0.
  bool have_ended(const std::vector<std::string>& names) {
    for (Status ended = children_.check(); !ended; ended = children_.check()) {
      EXPECT_NE(ended.error().message.find("exit code 0"), std::string::npos) << ended.error().message;
      ended_.push_back(ended.error().message);
    }
    return std::ranges::all_of(names, [&](const std::string& name) {
      return std::ranges::any_of(ended_, [&](const std::string& end) { return end.starts_with(name + " has ended"); });
    });
  }
  /// A server whose state is in folder_/server has an answer for every pair, and a map with it, by a status that is
  /// written after this is asked. Robots end before that: what they sent is stored, and not yet looked at.
  [[nodiscard]] bool server_has_map() {
    const fs::path file = folder_ / "server" / program::kStatusFile;
    const auto asked = fs::file_time_type::clock::now();
    return within(kPatience_s, [&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      std::error_code failed;
      if (fs::last_write_time(file, failed) < asked + std::chrono::milliseconds(100) || failed) return false;
      const auto status = nlohmann::json::parse(read_file(file.string()).value_or(""), nullptr, false);
      return status.is_object() && status.at("pending_jobs") == 0 && status.at("has_news") == false;
    });
  }

  std::vector<std::string> ended_;
};

/// Types are matched by name alone: what a real robot recorded must arrive in the very bytes.
TEST_F(Ros, ARealBagArrivesInAnotherProcessToTheByte) {
  TUTTI_REQUIRE_SHARED("data/mcap/nav2_turtlebot.mcap");
  const std::string bag = test::shared_path("data/mcap/nav2_turtlebot.mcap").string();
  std::map<std::string, std::vector<std::string>> expected, heard;
  const auto reader = bags::open_bag(bag).value();
  for (auto message = reader->next().value(); message; message = reader->next().value())
    expected[message->channel->topic].emplace_back(message->data);
  ASSERT_EQ(expected["/odom"].size(), 2639U);
  const auto participant = join_loopback();
  const auto odom = participant->reader("/r1/odom", "nav_msgs/msg/Odometry", kKeepAll, "").value();
  const auto tf = participant->reader("/tf", "tf2_msgs/msg/TFMessage", kKeepAll, "").value();
  start("play",
        {"bag", "play", bag, "--namespace", "r1", "--rate", "1000", "--wait-for", "/r1/odom", "--wait-for", "/tf"});
  const auto late = participant->reader("/tf_static", "tf2_msgs/msg/TFMessage", ros::kStaticTfQos, "").value();
  const auto hear = [&](ros::Reader& from, const std::string& topic) {
    for (std::string& message : taken(from)) heard[topic].push_back(std::move(message));
    return heard[topic].size() >= expected[topic].size();
  };
  ASSERT_TRUE(within(kPatience_s,
                     [&] {
                       participant->wait(0.05);
                       const bool is_odometry_there = hear(*odom, "/odom"), is_tf_there = hear(*tf, "/tf");
                       return is_odometry_there && is_tf_there && hear(*late, "/tf_static");
                     }))
      << heard["/odom"].size() << " of /odom, " << heard["/tf"].size() << " of /tf";
  for (const char* topic : {"/odom", "/tf", "/tf_static"}) EXPECT_EQ(heard[topic], expected[topic]) << topic;
}

/// Strangers may publish anything as any type, and what comes behind it is heard.
TEST_F(Ros, NonsenseFromAnotherProcessDoesNoHarm) {
  const std::string bag = (folder_ / "odd.mcap").string();
  std::vector<std::string> sent;
  {
    auto writer = bags::RosWriter::create(bag).value();
    std::mt19937 rng(1);
    for (int i = 0; i < 300; ++i) {
      std::string bytes(4 + rng() % (i % 10 == 0 ? 200'000 : 100), '\0');
      for (std::size_t k = 2; k < bytes.size(); ++k) bytes[k] = static_cast<char>(rng());  // behind what marks CDR
      ASSERT_TRUE(writer.write("/odom", "nav_msgs/msg/Odometry", {i * 1'000'000}, bytes));
      sent.push_back(std::move(bytes));
    }
    ASSERT_TRUE(writer.close());
  }
  const auto participant = join_loopback();
  const auto odom = participant->reader("/odom", "nav_msgs/msg/Odometry", kKeepAll, "").value();
  start("play", {"bag", "play", bag, "--wait-for", "/odom"});
  std::vector<std::string> heard;
  ASSERT_TRUE(within(kPatience_s,
                     [&] {
                       participant->wait(0.05);
                       for (std::string& message : taken(*odom)) heard.push_back(std::move(message));
                       return heard.size() == sent.size();
                     }))
      << heard.size() << output_of("play");
  intake::RosIntake intake({});
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(heard[i].substr(0, sent[i].size()), sent[i]);  // filled up to a multiple of four
    EXPECT_LT(heard[i].size(), sent[i].size() + 4);
    EXPECT_FALSE(intake.add_odometry(heard[i]));
    EXPECT_FALSE(intake.add_points(heard[i]));
    EXPECT_FALSE(intake.add_tf(heard[i], false));
  }
}

/// Two robots in a small tunnel, with receivers.
constexpr const char* kSimulated = R"(
source: simulation
simulation:
  sensors: lidar
  lidar: {rays_share: 0.4}
  world: {kind: tunnel, network: {rows: 2, columns: 2, block_m: 10.0, jitter_m: 1.0}}
  robots:
    - {name: alpha, walk: {duration_s: 40}}
    - {name: bravo, walk: {duration_s: 40}}
receivers: [{rate_hz: 2.0, sigma_m: 0.5, antenna_m: [0.3, 0.0, 0.6]}]
odometry_hz: 20
closures: {verifier: lidar}
)";
constexpr std::size_t kOdometrySamples = 802;
constexpr const char* kRecorded = R"(
mission: bags
robots:
  - {name: alpha, bag: alpha}
  - {name: bravo, bag: bravo}
agent: {submap: {duration_s: 6.0}}
closures: {verifier: lidar}
)";

/// The published transforms map -> odom of a robot: their stamps, and when that was.
struct Heard {
  std::vector<Timestamp> stamps, published;
};

void hear_transforms(ros::Reader& tf, std::map<std::string, Heard>& heard) {
  tf.take([&](const ros::Message& message) {
    const auto transforms = bags::decode_tf(message.cdr).value();
    for (const bags::RosTransform& transform : transforms) {
      if (!transform.header.frame_id.ends_with("/map")) continue;
      Heard& robot = heard[transform.header.frame_id];
      robot.stamps.push_back(transform.header.stamp);
      robot.published.push_back(message.published);
    }
  });
}

std::string in_words(std::vector<double> ms) {
  std::ranges::sort(ms);
  const auto share = [&](double part) {
    return ms[static_cast<std::size_t>(part * static_cast<double>(ms.size() - 1))];
  };
  return fmt::format("median {:.1f} ms, 99 % {:.1f} ms, longest {:.1f} ms", share(0.5), share(0.99), share(1.0));
}

std::string gaps_of(const std::vector<Timestamp>& times) {
  std::vector<double> gaps_ms;
  for (std::size_t i = 1; i < times.size(); ++i) gaps_ms.push_back(1e3 * (times[i] - times[i - 1]));
  return in_words(std::move(gaps_ms));
}

/// How long after odometry, by its stamp, its transform was published. `sampled`: when odometry was.
std::string latency_of(const Heard& heard, const std::map<Timestamp, Timestamp>& sampled) {
  constexpr double kTolerance_s = 0.1;  // by which transforms are dated ahead
  std::vector<double> latencies_ms;
  for (std::size_t i = 0; i < heard.stamps.size(); ++i)
    if (const auto at = sampled.find(heard.stamps[i] - kTolerance_s); at != sampled.end())
      latencies_ms.push_back(1e3 * (heard.published[i] - at->second));
  return fmt::format("{} of {}: {}", latencies_ms.size(), heard.stamps.size(), in_words(latencies_ms));
}

/// The payloads of submaps, by robot and number: those of the same images are as large.
using Sizes = std::map<std::pair<std::uint32_t, std::uint32_t>, PayloadSize>;
struct Closed {
  server::MapEstimate estimate;
  Sizes sizes;
};
/// As closures alone make the map: when a server of images has refined it is a matter of time.
Closed closed(mapfile::Content map) {
  map.refinements = {};
  Closed out{mapfile::estimate(map), {}};
  for (const auto& [id, size] : map.payload_sizes) out.sizes[{id.chain.robot.value, id.index}] = size;
  return out;
}

mapfile::Content map_of_bags(const lab::MissionSource& source) {
  mapfile::Content out;
  mission::RunOptions options{.data = source.data, .seed = 1, .threads = 1};
  options.keep_map = [&](const storage::TableStore& store) -> Status {
    out = mapfile::read(store).value();
    return {};
  };
  const auto run = lab::run_mission(lab::load(source).value(), options);
  EXPECT_TRUE(run) << run.error().message;
  return out;
}

/// Robots are numbered alike, sessions are not.
std::vector<std::array<std::uint32_t, 4>> accepted(const server::MapEstimate& map) {
  std::vector<std::array<std::uint32_t, 4>> out;
  for (const server::JudgedClosure& closure : map.closures)
    if (const auto& from = closure.closure.from, &to = closure.closure.to; closure.accepted)
      out.push_back({from.chain.robot.value, from.index, to.chain.robot.value, to.index});
  return out;
}

std::size_t fixes_of(const server::MapEstimate& map) {
  std::size_t out = 0;
  for (const server::JudgedFixes& judged : map.fixes.judged) out += judged.fixes;
  return out;
}

void expect_same(const server::MapEstimate& actual, const server::MapEstimate& expected) {
  EXPECT_EQ(accepted(actual), accepted(expected));
  ASSERT_EQ(actual.nodes.size(), expected.nodes.size());
  double worst_m = 0.0;
  for (std::size_t i = 0; i < actual.nodes.size(); ++i) {
    EXPECT_EQ(actual.nodes[i].stamp, expected.nodes[i].stamp);
    worst_m = std::max(worst_m,
                       (actual.nodes[i].T_world_body.translation - expected.nodes[i].T_world_body.translation).norm());
  }
  EXPECT_LT(worst_m, 1e-3);
  EXPECT_EQ(fixes_of(actual), fixes_of(expected));
  ASSERT_EQ(actual.fixes.georeference.has_value(), expected.fixes.georeference.has_value());
  if (expected.fixes.georeference) {
    EXPECT_EQ(actual.fixes.georeference->origin, expected.fixes.georeference->origin);
  }
  fmt::print("{} nodes, {} closures; {} m from the map of the bags at most\n", actual.nodes.size(),
             accepted(actual).size(), worst_m);
}

/// A map to drive on, in parts that are free, occupied and unknown; the cells alone are looked at.
void expect_grid(std::string_view cdr) {
  bags::internal::Cursor in(cdr.substr(4), bags::internal::Cursor::Order::little,
                            bags::internal::Cursor::Layout::aligned);
  in.number<std::int32_t>("sec");
  in.number<std::uint32_t>("nanosec");
  EXPECT_EQ(in.counted("frame_id"), std::string_view("world\0", 6));
  in.number<std::int32_t>("map_load_time");
  in.number<std::uint32_t>("map_load_time");
  EXPECT_EQ(in.number<float>("resolution"), 0.1F);
  const auto width = in.number<std::uint32_t>("width"), height = in.number<std::uint32_t>("height");
  for (int i = 0; i < 7; ++i) in.number<double>("origin");
  const std::string_view cells = in.counted("data");
  EXPECT_TRUE(in.ok()) << in.error().value_or("");
  EXPECT_EQ(cells.size(), std::size_t{width} * height);
  for (const char cell : {'\xff', '\0', 'd'}) EXPECT_GT(std::ranges::count(cells, cell), 50) << int{cell};
}

/// TUTTI_ROS_RATE=1: in real time as a robot would, where sensors are best effort.
TEST_F(Ros, TwoRobotsAndAServerMakeTheMapOfTheirBags) {
  TUTTI_SKIP_WITHOUT_NATS_SERVER();
  const char* const asked = std::getenv("TUTTI_ROS_RATE");
  const std::string rate = asked == nullptr ? "30" : asked;
  ASSERT_TRUE(write_file((folder_ / "simulated.yaml").string(), kSimulated));
  ASSERT_TRUE(write_file((folder_ / "bags.yaml").string(), kRecorded));
  const auto simulated = lab::load({.file = (folder_ / "simulated.yaml").string()}).value();
  ASSERT_TRUE(lab::write_bags(simulated, 1, folder_.string()));
  const lab::MissionSource source{.file = (folder_ / "bags.yaml").string(), .data = folder_};
  const auto expected = mapfile::estimate(map_of_bags(source));
  ASSERT_GT(accepted(expected).size(), 3U);
  ASSERT_GT(fixes_of(expected), 100U);

  const auto participant = join_loopback();
  const auto tf = participant->reader("/tf", "tf2_msgs/msg/TFMessage", kKeepAll, "").value();
  const auto odom = participant->reader("/alpha/odom", "nav_msgs/msg/Odometry", kKeepAll, "").value();
  const auto grid = participant->reader("/world/map", "nav_msgs/msg/OccupancyGrid", ros::kLatchedQos, "").value();
  const auto cloud =
      participant->reader("/world/map_points", "sensor_msgs/msg/PointCloud2", ros::kLatchedQos, "").value();
  const std::vector<std::string> mission{source.file, "--data", folder_.string(), "--rate", rate};
  start("server", {"server", "--ros", "--map-period", "1", "--state", (folder_ / "server").string()}, mission);
  const std::string bus = bus_of("server");
  std::vector<std::string> robot{"robot", "--ros", "--bus", bus, "--end-after", "2"};
  if (rate != "1") robot.push_back("--reliable");
  for (const std::string name : {"alpha", "bravo"}) {
    std::vector<std::string> command = robot;
    command.insert(command.end(), {"--name", name, "--state", (folder_ / ("of_" + name)).string()});
    start(name, command, mission);
  }
  start("play",
        {"bag", "play", (folder_ / "alpha").string(), (folder_ / "bravo").string(), "--rate", rate, "--wait-for",
         "/alpha/points", "--wait-for", "/bravo/points", "--wait-for", "/alpha/fix", "--wait-for", "/bravo/fix"});
  std::map<std::string, Heard> heard;
  std::map<Timestamp, Timestamp> sampled;
  std::vector<std::string> grids, clouds;
  ASSERT_TRUE(within(kPatience_s + 60.0 / std::stod(rate),
                     [&] {
                       participant->wait(0.02);
                       hear_transforms(*tf, heard);
                       odom->take([&](const ros::Message& message) {
                         sampled[bags::decode_odometry(message.cdr).value().header.stamp] = message.published;
                       });
                       for (std::string& message : taken(*grid)) grids.push_back(std::move(message));
                       for (std::string& message : taken(*cloud)) clouds.push_back(std::move(message));
                       return have_ended({"alpha", "bravo"}) && !grids.empty() && !clouds.empty();
                     }))
      << output_of("alpha") << output_of("server");
  ASSERT_TRUE(server_has_map()) << output_of("server");
  children_.stop_all();

  const auto store = mapfile::open(folder_ / "server/map.tutti").value();
  const auto actual = mapfile::estimate(mapfile::read(*store).value());
  expect_same(actual, expected);
  expect_grid(grids.back());
  const auto points = bags::to_timed_cloud(bags::decode_point_cloud(clouds.back()).value()).value();
  EXPECT_GT(points.cloud.points.size(), 1000U);
  ASSERT_EQ(heard.size(), 2U);
  fmt::print("{}", output_of("play"));
  for (const auto& [frame, robot_heard] : heard) {
    EXPECT_EQ(robot_heard.stamps.size(), kOdometrySamples) << frame;  // one for each
    fmt::print("{}: {} times; gaps of stamps: {}; of publication: {}\n", frame, robot_heard.stamps.size(),
               gaps_of(robot_heard.stamps), gaps_of(robot_heard.published));
    if (frame == "alpha/map") fmt::print("  after odometry, {}\n", latency_of(robot_heard, sampled));
  }
}

/// Two flights through a small hall, with stereo pairs or with RGB-D cameras, and IMUs.
constexpr const char* kFlown = R"(
source: hall
hall:
  {}
  robots:
    - {{name: alpha, flight: {{start_deg: 0.0, duration_s: 10}}}}
    - {{name: bravo, flight: {{start_deg: 20.0, height_m: 2.0, duration_s: 10}}}}
)";
constexpr const char* kSeen = R"(
mission: seen
robots:
  - {name: alpha, bag: alpha}
  - {name: bravo, bag: bravo}
agent: {submap: {duration_s: 5.0, representative_distance_m: 0.3, visual: {send_imu: true}}}
tracking: {tracker: {descriptors: {kind: orb}}}
closures: {verifier: visual}
)";

/// Verifiers draw by submaps' names, hence the session. Alpha's cameras and IMU are found by type, because the
/// mission's closures are of images; bravo is given its own. TUTTI_ROS_RATE as above.
class RosImages : public Ros {
 protected:
  void expect_closures_of_bags(const std::string& cameras, const std::vector<std::string>& images,
                               const std::vector<std::string>& of_bravo) {
    ASSERT_TRUE(write_file((folder_ / "flown.yaml").string(), fmt::format(fmt::runtime(kFlown), cameras)));
    ASSERT_TRUE(write_file((folder_ / "seen.yaml").string(), kSeen));
    ASSERT_TRUE(lab::write_bags(lab::load({.file = (folder_ / "flown.yaml").string()}).value(), 1, folder_.string()));
    const lab::MissionSource source{.file = (folder_ / "seen.yaml").string(), .data = folder_};
    const Closed expected = closed(map_of_bags(source));
    ASSERT_GT(accepted(expected.estimate).size(), 10U);

    const char* const asked = std::getenv("TUTTI_ROS_RATE");
    const std::string rate = asked == nullptr ? "5" : asked;
    const std::vector<std::string> mission{source.file, "--data", folder_.string(), "--rate", rate};
    start("server", {"server", "--state", (folder_ / "server").string()}, mission);
    const std::string bus = bus_of("server");
    std::vector<std::string> robot{"robot", "--ros",       "--points", "",          "--bus",
                                   bus,     "--end-after", "3",        "--session", "0"};
    if (rate != "1") robot.push_back("--reliable");
    for (const std::string name : {"alpha", "bravo"}) {
      std::vector<std::string> command = robot;
      command.insert(command.end(), {"--name", name, "--state", (folder_ / ("of_" + name)).string()});
      if (name == "bravo") command.insert(command.end(), of_bravo.begin(), of_bravo.end());
      start(name, command, mission);
    }
    std::vector<std::string> play{"bag",    "play", (folder_ / "alpha").string(), (folder_ / "bravo").string(),
                                  "--rate", rate};
    const auto wait_for = [&play](const std::string& topic) { play.insert(play.end(), {"--wait-for", topic}); };
    for (const std::string name : {"/alpha/", "/bravo/"}) {
      for (const std::string topic : {"odom", "imu"}) wait_for(name + topic);
      for (const std::string& topic : images)
        for (const std::string part : {"/image_raw", "/camera_info"}) wait_for(name + topic + part);
    }
    start("play", play);
    ASSERT_TRUE(within(3 * kPatience_s,
                       [&] {
                         std::this_thread::sleep_for(std::chrono::milliseconds(50));
                         return have_ended({"alpha", "bravo"});
                       }))
        << output_of("alpha") << output_of("server") << output_of("play");
    ASSERT_TRUE(server_has_map()) << output_of("server");
    children_.stop_all();
    for (const std::string name : {"alpha", "bravo"})
      EXPECT_EQ(output_of(name).find("refuse"), std::string::npos) << output_of(name);

    const auto store = mapfile::open(folder_ / "server/map.tutti").value();
    const Closed actual = closed(mapfile::read(*store).value());
    EXPECT_EQ(actual.sizes, expected.sizes);
    expect_same(actual.estimate, expected.estimate);
    fmt::print("{}{}", output_of("alpha"), output_of("play"));
  }
};

TEST_F(RosImages, RobotsWithCamerasMakeTheClosuresOfTheirBags) {
  TUTTI_SKIP_WITHOUT_NATS_SERVER();
  expect_closures_of_bags("cameras: 2", {"camera0", "camera1"},
                          {"--images", "camera0/image_raw,/bravo/camera1/image_raw", "--imu", "imu"});
}

TEST_F(RosImages, RobotsWithRgbdCamerasMakeTheClosuresOfTheirBags) {
  TUTTI_SKIP_WITHOUT_NATS_SERVER();
  expect_closures_of_bags("depth: true", {"camera0", "depth"},
                          {"--images", "camera0/image_raw", "--depth", "depth/image_raw", "--imu", "imu"});
}

}  // namespace ros_test
}  // namespace tutti
