// SPDX-License-Identifier: BSD-3-Clause
// A robot that finds its place in yesterday's map, as its navigation stack sees it: by what the program publishes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "support/lab/ros_programs.hpp"
#include "support/program/ros/loopback.hpp"
#include "support/program/ros/tf_buffer.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/lab/write_bags.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti {
namespace ros_localise_test {

using ros::test::join_loopback, ros::test::kKeepAll, ros::test::taken, test::within;

constexpr double kPatience_s = 120.0;
constexpr const char* kTf = "tf2_msgs/msg/TFMessage";
constexpr const char* kPose = "geometry_msgs/msg/PoseWithCovarianceStamped";
/// Alpha and bravo make the map, charlie is there a day later.
constexpr const char* kSimulated = R"(
source: simulation
simulation:
  sensors: lidar
  lidar: {rays_share: 0.4}
  world: {kind: tunnel, network: {rows: 2, columns: 2, block_m: 22.0}, featureless_share: 0.0}
  robots:
    - {name: alpha, walk: {duration_s: 90, rate_hz: 5}}
    - {name: bravo, walk: {duration_s: 90, rate_hz: 5}}
    - {name: charlie, walk: {duration_s: 60, rate_hz: 5}}
closures: {verifier: lidar}
)";

Pose3 pose_of(const bags::RosPose& pose) { return {pose.orientation.normalized(), pose.position}; }

class RosLocalise : public ::testing::Test, protected ros::test::Programs {
 protected:
  RosLocalise() : Programs("ros_localise_", kPatience_s) {}
  void make_bags() {
    const auto file = (folder_ / "simulated.yaml").string();
    ASSERT_TRUE(write_file(file, kSimulated));
    ASSERT_TRUE(lab::write_bags(lab::load({.file = file}).value(), 3, folder_.string()));
  }
  Trajectory truth_of(const std::string& robot) {
    Trajectory out;
    const auto bag = bags::open_bag((folder_ / robot).string()).value();
    for (auto message = bag->next().value(); message; message = bag->next().value())
      if (message->channel->topic == "/" + robot + "/truth") {
        const auto pose = bags::decode_pose_stamped(message->data).value();
        out.push_back({pose.header.stamp, pose_of(pose.pose)});
      }
    return out;
  }
  /// Makes folder_/site.tutti; where its world is in the simulation's.
  Pose3 make_map() {
    start("run", {"run", (folder_ / "alpha").string(), (folder_ / "bravo").string(), "--map",
                  (folder_ / "site.tutti").string(), "-o", (folder_ / "out").string()});
    Status ended;
    EXPECT_TRUE(within(kPatience_s, [&] { return !(ended = children_.check()); }));
    EXPECT_NE(ended.error().message.find("exit code 0"), std::string::npos) << ended.error().message;
    const auto store = mapfile::open(folder_ / "site.tutti").value();
    const auto map = mapfile::estimate(mapfile::read(*store).value());
    const MapNode& first = map.nodes.front();  // alpha's
    return pose_at(truth_of("alpha"), first.stamp).value() * first.T_world_body.inverse();
  }
};

TEST_F(RosLocalise, APoseInTheMapIsPublishedWhereTheRobotIsAndNowhereElse) {
  make_bags();
  const Pose3 T_truth_world = make_map();
  const Trajectory truth = truth_of("charlie");
  const auto participant = join_loopback();
  const auto tf = participant->reader("/tf", kTf, kKeepAll, "").value();
  const auto poses = participant->reader("/charlie/localised_pose", kPose, kKeepAll, "").value();
  const auto start_pose = participant->writer("/charlie/initialpose", kPose, {.reliable = true}, "").value();
  start("charlie", {"robot", "--ros", "--reliable", "--name", "charlie", "--map", (folder_ / "site.tutti").string(),
                    "--localise", "--rate", "3", "--stay", "--state", (folder_ / "of_charlie").string()});
  start("play", {"bag", "play", (folder_ / "charlie").string(), "--rate", "3", "--wait-for", "/charlie/points",
                 "--wait-for", "/charlie/odom", "--wait-for", "/tf"});
  ros::test::TfBuffer frames;
  std::size_t told = 0;
  double worst_m = 0.0;
  std::optional<Timestamp> first, last;
  bool has_started = false;
  const auto look = [&] {
    participant->wait(0.05);
    frames.take(*tf);
    if (!has_started && frames.find("charlie/map", "charlie/odom")) {  // a start pose of where the robot is not
      const Pose3 wrong =
          T_truth_world.inverse() * pose_at(truth, Timestamp{truth.front().stamp.ns + 40'000'000'000}).value();
      bags::RosPoseWithCovariance message{.header = {{}, "world"}, .pose = bags::to_ros(wrong)};
      message.covariance[0] = message.covariance[7] = 0.25;
      message.covariance[35] = 0.07;
      has_started = start_pose->write(bags::encode(message)).has_value();
    }
    for (const std::string& cdr : taken(*poses)) {
      const auto message = bags::decode_pose_with_covariance(cdr).value();
      EXPECT_EQ(message.header.frame_id, "world");
      const auto at = pose_at(truth, message.header.stamp);
      if (!at) continue;
      ++told;
      const double error_m = ((T_truth_world * pose_of(message.pose)).translation - at->translation).norm();
      worst_m = std::max(worst_m, error_m);
      if (!first) first = message.header.stamp;
      last = message.header.stamp;
    }
    return output_of("play").find("messages of") != std::string::npos && last && truth.back().stamp - *last < 1.0;
  };
  EXPECT_TRUE(within(kPatience_s, look)) << output_of("charlie") << output_of("play");
  ASSERT_TRUE(first) << output_of("charlie");
  fmt::print("{} poses, the first {:.1f} s after the start, {:.2f} m off at most\n", told, *first - truth.front().stamp,
             worst_m);
  EXPECT_LT(worst_m, 0.5);
  EXPECT_LT(*first - truth.front().stamp, 40.0);
  EXPECT_GT(told, 50U);
  for (const char* line :
       {"world -> charlie/map\n", "charlie/map -> charlie/odom\n", "charlie/odom -> charlie/base_link\n"})
    EXPECT_NE(frames.text().find(line), std::string::npos) << frames.text();
  const auto T_world_body = frames.find("world", "charlie/base_link");
  ASSERT_TRUE(T_world_body) << frames.text();
  EXPECT_LT(((T_truth_world * *T_world_body).translation - truth.back().pose.translation).norm(), 0.7);
}

}  // namespace ros_localise_test
}  // namespace tutti
