// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/run_scene.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "tutti/base/file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::exports {
namespace run_scene_test {

namespace fs = std::filesystem;

Pose3 pose(double x, double y, double yaw) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, y, 0.0}};
}

/// Two robots on an arc; bravo's clock is another one, and it starts two seconds later.
class RunScene : public testing::Test {
 protected:
  RunScene() {
    fs::create_directories(folder_);
    for (int r = 0; r < 2; ++r) {
      const std::string name = r == 0 ? "alpha" : "bravo.2";
      Trajectory onboard, corrected, server;
      for (int i = 0; i < 5; ++i) {
        const Timestamp stamp = Timestamp{r == 0 ? 50'000'000'000 : 900'000'000'000} + i;
        const Pose3 truth = pose(i, 0.2 * i * i, 0.3 * i);
        server.push_back({stamp, truth});
        corrected.push_back({stamp, T_map_world_ * truth});
        onboard.push_back({stamp, pose(1.1 * i, 0.2 * i * i, 0.3 * i)});
        graph_.poses.push_back(truth);
        stamps_.push_back(
            {5 * r + i, {ChainId(RobotId{static_cast<std::uint32_t>(r)}, 1), static_cast<std::uint32_t>(i)}, stamp});
        if (i > 0) graph_.edges.push_back({graph_.poses.size() - 2, graph_.poses.size() - 1, {}, Matrix6d::Identity()});
      }
      const std::string file = r == 0 ? "alpha_" : "bravo_2_";
      EXPECT_TRUE(formats::write_tum((folder_ / (file + "onboard.tum")).string(), onboard));
      EXPECT_TRUE(formats::write_tum((folder_ / (file + "corrected.tum")).string(), corrected));
      EXPECT_TRUE(formats::write_tum((folder_ / (file + "server.tum")).string(), server));
    }
    graph_.edges.push_back({4, 9, {}, Matrix6d::Identity()});
    EXPECT_TRUE(formats::write_g2o((folder_ / "graph.g2o").string(), graph_));
    EXPECT_TRUE(formats::write_graph_stamps((folder_ / "graph_stamps.csv").string(), stamps_));
    EXPECT_TRUE(write_file((folder_ / "report.json").string(), R"({"robots": [
        {"name": "alpha", "start_s": 0.0, "alerts": [], "explanation": null},
        {"name": "bravo.2", "start_s": 2.0, "explanation": {"aligned_rmse_m": 0.5, "suspected_origins": []},
         "alerts": [{"from_s": 2.5, "until_s": 3.0, "known_since_s": 4.0, "place_m": [1, 2, 3], "significance": 7.0}]}],
        "server": {"course": [{"time_s": 3.0, "closures_accepted": 1}], "T_reference_world": null}})"));
  }
  ~RunScene() override { fs::remove_all(folder_); }

  fs::path folder_ = fs::path(testing::TempDir()) / ("run_scene_" + std::to_string(getpid()));
  Pose3 T_map_world_ = pose(7.0, -3.0, 1.0);
  PoseGraph graph_;
  std::vector<formats::VertexStamp> stamps_;
};

TEST_F(RunScene, StampsAreTheMissionsAndFramesMeet) {
  const auto scene = scene_of_run(folder_.string());
  ASSERT_TRUE(scene) << scene.error().message;
  const auto track = [&](const std::string& topic) {
    return *std::ranges::find(scene->tracks, topic, &Scene::Track::topic);
  };
  EXPECT_EQ(track("alpha/server").poses[0].stamp.ns, 50'000'000'000);
  EXPECT_EQ(track("bravo_2/server").poses[0].stamp.ns, 52'000'000'000);
  const auto still = std::ranges::find(scene->still, "bravo_2/map", &Scene::Transform::child);
  ASSERT_NE(still, scene->still.end());
  EXPECT_EQ(still->parent, "world");
  EXPECT_LT(local(still->T_parent_child, T_map_world_.inverse()).norm(), 1e-6);
  const auto moving = std::ranges::find(scene->motions, "bravo_2/odom", &Scene::Motion::child);
  for (const auto& [stamp, T_map_odom] : moving->poses) {
    const auto onboard = track("bravo_2/onboard").poses, corrected = track("bravo_2/corrected").poses;
    const auto i = static_cast<std::size_t>(std::ranges::find(onboard, stamp, &StampedPose::stamp) - onboard.begin());
    EXPECT_LT(local(T_map_odom * onboard.at(i).pose, corrected.at(i).pose).norm(), 1e-6);
  }
}

TEST_F(RunScene, ClosuresAlertsAndNumbersAreTheReports) {
  const Scene scene = scene_of_run(folder_.string()).value();
  ASSERT_EQ(scene.closures.size(), 1U);
  EXPECT_EQ(scene.closures[0].name, "alpha keyframe 4 - bravo_2 keyframe 4");
  EXPECT_TRUE(scene.closures[0].between_robots);
  EXPECT_EQ(scene.closures[0].stamp.ns, 56'000'000'000);
  ASSERT_EQ(scene.alerts.size(), 1U);
  EXPECT_TRUE(scene.alerts[0].is_error);
  EXPECT_EQ(scene.alerts[0].stamp.ns, 54'000'000'000);
  const auto onboard = std::ranges::find(scene.numbers, "bravo_2/to_server", &Scene::Numbers::topic);
  ASSERT_NE(onboard, scene.numbers.end());
  EXPECT_GT(onboard->values[0].second, 1e-3);         // raw odometry
  EXPECT_NEAR(onboard->values[1].second, 0.0, 1e-6);  // corrected
}

TEST_F(RunScene, OtherFoldersAreRefused) {
  EXPECT_EQ(scene_of_run("/no/such").error().code, ErrorCode::io);
  EXPECT_TRUE(write_file((folder_ / "report.json").string(), "[]"));
  EXPECT_EQ(scene_of_run(folder_.string()).error().code, ErrorCode::parse);
  EXPECT_TRUE(write_file((folder_ / "report.json").string(), R"({"robots": [{"name": "gone"}]})"));
  EXPECT_EQ(scene_of_run(folder_.string()).error().code, ErrorCode::invalid);
}

}  // namespace run_scene_test
}  // namespace tutti::exports
