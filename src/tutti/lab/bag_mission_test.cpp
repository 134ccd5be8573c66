// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/write_bags.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/robot/odometry_covariance.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::lab {
namespace bag_mission_test {

namespace fs = std::filesystem;

/// The map that a mission ends with.
class MapOf {
 public:
  mission::RunOptions options() {
    mission::RunOptions out{.seed = 1, .threads = 1};
    out.keep_map = [this](const storage::TableStore& store) -> Status {
      const auto content = mapfile::read(store);
      if (!content) return tl::unexpected(content.error());
      names_ = content->names;
      map_ = mapfile::estimate(*content);
      return {};
    };
    return out;
  }
  const server::MapEstimate& operator*() const { return *map_; }
  [[nodiscard]] const std::map<RobotId, std::string>& names() const { return names_; }

 private:
  std::map<RobotId, std::string> names_;
  std::optional<server::MapEstimate> map_;
};

/// Writes the bags of a mission and runs both; a bag's odometry is given the covariances of recordings, so the
/// mission's is, too. `from_bags` has its settings.
void expect_same(const MissionConfig& config, mission::MissionConfig from_bags) {
  mission::MissionParts parts{
      .input = load_input(config, {}, 1).value(), .verifier = nullptr, .refiner = nullptr, .companions = {}};
  for (mission::MissionRecording& robot : parts.input.robots) {
    robot.recording.increment_covariance = robot::increment_covariances(robot.recording.odometry, {});
    robot.recording.imu_noise = {};
  }
  parts.verifier = verifiers::make_verifier(config.closures);
  parts.refiner = verifiers::make_refiner(config.closures, config.refinement);
  MapOf simulated, recorded;
  ASSERT_TRUE(mission::run_mission(config, std::move(parts), simulated.options()));

  const fs::path folder = fs::path(::testing::TempDir()) / ("bag_mission_" + std::to_string(getpid()));
  const auto bags = write_bags(config, 1, folder.string());
  ASSERT_TRUE(bags) << bags.error().message;
  for (const WrittenBag& bag : *bags)
    from_bags.robots.push_back({.name = fs::path(bag.folder).filename().string(), .bag = bag.folder});
  const auto run = mission::run_mission(from_bags, recorded.options());
  fs::remove_all(folder);
  ASSERT_TRUE(run) << run.error().message;

  EXPECT_EQ(recorded.names().at(RobotId{1}), from_bags.robots[1].name);
  const server::MapEstimate &expected = *simulated, &actual = *recorded;
  ASSERT_EQ(actual.nodes.size(), expected.nodes.size());
  double worst = 0.0;  // m and rad
  for (std::size_t i = 0; i < actual.nodes.size(); ++i) {
    EXPECT_EQ(actual.nodes[i].stamp.ns - kBagsBegin_ns, expected.nodes[i].stamp.ns);
    worst = std::max(worst, local(expected.nodes[i].T_world_body, actual.nodes[i].T_world_body).norm());
  }
  EXPECT_LT(worst, 1e-4);  // points are float32, and were moved to the LiDAR and back
  ASSERT_EQ(actual.closures.size(), expected.closures.size());
  EXPECT_GT(actual.closures.size(), 3U);
  for (std::size_t i = 0; i < actual.closures.size(); ++i) {
    const auto &one = actual.closures[i], &other = expected.closures[i];
    EXPECT_EQ(one.accepted, other.accepted);
    EXPECT_EQ(one.closure.from, other.closure.from);
    EXPECT_EQ(one.closure.to, other.closure.to);
  }
  fmt::print("{} nodes, {} closures; {} m or rad from the mission at most\n", actual.nodes.size(),
             actual.closures.size(), worst);
}

/// Two robots in a small tunnel.
TEST(BagMission, FromSimulatedBagsIsTheMission) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.lidar.rays_share = 0.4;
  config.simulation.world.network = {.rows = 2, .columns = 2, .block_m = 10.0, .jitter_m = 1.0};
  config.simulation.robots.resize(2);
  for (auto& robot : config.simulation.robots) robot.walk.duration_s = 40.0;
  expect_same(config, {});
}

/// Two flights with one camera each, whose depth is registered to it.
TEST(BagMission, OfRgbdCamerasIsTheMission) {
  MissionConfig config;
  config.agent.submap.duration_s = 5.0;
  config.agent.submap.representative_distance_m = 0.3;
  config.tracking.tracker.descriptors.kind = "orb";
  config.closures.verifier = "visual";
  config.closures.visual.max_hamming = 0.2;
  mission::MissionConfig from_bags = config;
  config.source = "hall";
  config.hall.depth = true;
  config.hall.robots = {{.name = "alpha"}, {.name = "bravo"}};
  for (auto& robot : config.hall.robots) robot.flight.duration_s = 10.0;
  config.hall.robots[1].flight.start_deg = 20.0;
  config.hall.robots[1].flight.height_m = 2.0;
  expect_same(config, std::move(from_bags));
}

}  // namespace bag_mission_test
}  // namespace tutti::lab
