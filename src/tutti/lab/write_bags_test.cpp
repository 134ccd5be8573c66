// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/write_bags.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>

#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/simulation/recordings.hpp"

namespace tutti::lab {
namespace write_bags_test {

namespace fs = std::filesystem;

fs::path fresh(const std::string& name) {
  fs::path folder = fs::path(::testing::TempDir()) / name;
  fs::remove_all(folder);
  return folder;
}

/// The contents of a bag, read back into what robots are fed.
struct Heard {
  Trajectory odometry, truth;
  std::vector<Matrix6d> increments;
  std::vector<Scan> scans;
  Pose3 T_body_lidar;
  std::vector<Timestamp> stamps;  ///< All messages' in their order.
};

Timestamp back(Timestamp stamp) { return Timestamp{stamp.ns - kBagsBegin_ns}; }

Scan to_scan(const bags::RosPointCloud& cloud, const Pose3& T_body_lidar) {
  auto points = std::make_shared<PointCloud>();
  auto ages = std::make_shared<std::vector<float>>();
  for (std::size_t i = 0; i < cloud.width; ++i) {
    std::array<float, 4> values{};
    std::memcpy(values.data(), cloud.data.data() + i * cloud.point_step, sizeof values);
    points->points.push_back((T_body_lidar * Eigen::Vector3d(values[0], values[1], values[2])).cast<float>());
    ages->push_back(-values[3]);
  }
  return {back(cloud.header.stamp), points, ages};
}

Heard hear(const fs::path& folder) {
  const auto reader = bags::open_bag(folder.string()).value();
  Heard out;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const bags::BagMessage& one = **message;
    out.stamps.push_back(one.log_time);
    const std::string& topic = one.channel->topic;
    if (topic.ends_with("/odom")) {
      const auto odometry = bags::decode_odometry(one.data).value();
      const Timestamp stamp = back(odometry.header.stamp);
      if (!out.odometry.empty()) {
        const double seconds = stamp - out.odometry.back().stamp;
        out.increments.push_back(seconds * seconds *
                                 Eigen::Map<const Matrix6d>(odometry.twist_covariance.data()));  // symmetric
      }
      out.odometry.push_back({stamp, {odometry.pose.orientation, odometry.pose.position}});
    } else if (topic.ends_with("/points")) {
      out.scans.push_back(to_scan(bags::decode_point_cloud(one.data).value(), out.T_body_lidar));
    } else if (topic.ends_with("/truth")) {
      const auto pose = bags::decode_pose_stamped(one.data).value();
      out.truth.push_back({back(pose.header.stamp), {pose.pose.orientation, pose.pose.position}});
    } else if (topic == "/tf_static") {
      const auto transforms = bags::decode_tf(one.data).value();
      for (const bags::RosTransform& transform : transforms)
        if (transform.child_frame_id.ends_with("/lidar"))
          out.T_body_lidar = {transform.rotation, transform.translation};
    }
  }
  return out;
}

TEST(WriteBags, WalkingRobotsAreHeardAsTheyWereSimulated) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.lidar.rays_share = 0.04;
  config.simulation.world.network = {.rows = 2, .columns = 2};
  for (auto& robot : config.simulation.robots) robot.walk.duration_s = 5.0;
  config.simulation.robots[1].start_s = 2.0;
  const auto input = simulation::simulate_recordings(config.simulation, Timestamp{0}, 3).value();
  const fs::path folder = fresh("write_bags");
  const auto bags = write_bags(config, 3, folder.string());
  ASSERT_TRUE(bags) << bags.error().message;
  ASSERT_EQ(bags->size(), 2U);
  for (std::size_t r = 0; r < 2; ++r) {
    const Recording& expected = input.recordings[r];
    const Heard heard = hear(folder / expected.name);
    EXPECT_TRUE(std::ranges::is_sorted(heard.stamps));
    EXPECT_EQ(heard.odometry.size(), expected.odometry.size());
    for (std::size_t i = 0; i < expected.odometry.size(); ++i) {
      EXPECT_EQ(heard.odometry[i].stamp, expected.odometry[i].stamp);
      EXPECT_TRUE(heard.odometry[i].pose == expected.odometry[i].pose);
      EXPECT_TRUE(heard.truth[i].pose == expected.reference[i].pose);
      if (i > 0) {
        EXPECT_TRUE(heard.increments[i - 1].isApprox(expected.increment_covariance[i - 1], 1e-9));
      }
    }
    std::size_t scans = 0;
    for (std::size_t i = 0; i < expected.odometry.size(); ++i) {
      const auto scan = expected.scans->scan(i).value();
      if (!scan) continue;
      const Scan& other = heard.scans.at(scans++);
      EXPECT_EQ(other.stamp, scan->stamp);
      EXPECT_EQ(*other.age_s, *scan->age_s);
      ASSERT_EQ(other.cloud->points.size(), scan->cloud->points.size());
      for (std::size_t k = 0; k < scan->cloud->points.size(); ++k)
        EXPECT_LT((other.cloud->points[k] - scan->cloud->points[k]).norm(), 1e-5F);
    }
    EXPECT_EQ(scans, heard.scans.size());
    EXPECT_GT(scans, 10U);
  }
  EXPECT_GE(hear(folder / "bravo").odometry.front().stamp, Timestamp{0} + 2.0);
  EXPECT_EQ(write_bags(config, 3, folder.string()).error().code, ErrorCode::io);  // nothing is overwritten
  fs::remove_all(folder);
}

TEST(WriteBags, FlyingRobotsHaveImagesCalibrationAndImu) {
  MissionConfig config;
  config.source = "hall";
  config.hall.depth = true;
  config.hall.robots = {{.name = "alpha", .sensors = "both"}};
  config.hall.robots[0].flight.duration_s = 0.5;
  const fs::path folder = fresh("write_bags_hall");
  const auto bags = write_bags(config, 1, folder.string());
  ASSERT_TRUE(bags) << bags.error().message;
  const auto reader = bags::open_bag((folder / "alpha").string()).value();
  const bags::BagInfo info = bags::inspect(*reader);
  std::map<std::string, std::string> frames;
  for (const bags::TopicInfo& topic : info.topics) {
    EXPECT_EQ(topic.problem, "") << topic.topic;
    EXPECT_GT(topic.count, 3U * (topic.topic == "/tf_static" ? 0 : 1)) << topic.topic;
    frames[topic.topic] = topic.frames;
  }
  EXPECT_EQ(frames, (std::map<std::string, std::string>{
                        {"/alpha/camera0/camera_info", "alpha/camera0"},
                        {"/alpha/camera0/image_raw", "alpha/camera0"},
                        {"/alpha/depth/camera_info", "alpha/camera0"},
                        {"/alpha/depth/image_raw", "alpha/camera0"},
                        {"/alpha/imu", "alpha/base_link"},
                        {"/alpha/odom", "alpha/odom -> alpha/base_link"},
                        {"/alpha/points", "alpha/lidar"},
                        {"/alpha/truth", "world"},
                        {"/tf", "alpha/odom -> alpha/base_link"},
                        {"/tf_static", "alpha/base_link -> alpha/lidar, alpha/base_link -> alpha/camera0"}}));
  fs::remove_all(folder);
}

TEST(WriteBags, RecordingsAreRefused) {
  MissionConfig config;
  config.mission = "hku";
  config.source = "recordings";
  EXPECT_EQ(write_bags(config, 1, "nowhere").error().message,
            "hku: source is 'recordings', expected 'simulation' or 'hall'");
}

}  // namespace write_bags_test
}  // namespace tutti::lab
