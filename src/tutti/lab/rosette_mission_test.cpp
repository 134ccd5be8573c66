// SPDX-License-Identifier: BSD-3-Clause
// Closures from scans that have hardly a ray in common, as those of a Livox Mid-360.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tutti/lab/run_mission.hpp"

namespace tutti::lab {
namespace rosette_mission_test {

mission::ServerRecord server_of(const simulation::LidarChoice& lidar) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.lidar = lidar;
  config.simulation.world.network = {.rows = 2, .columns = 2, .block_m = 10.0, .jitter_m = 1.0};
  config.simulation.robots.resize(2);
  for (auto& robot : config.simulation.robots) robot.walk.duration_s = 40.0;
  const auto record = run_mission(config, {.seed = 1, .threads = 1});
  EXPECT_TRUE(record) << record.error().message;
  return record ? record->server : mission::ServerRecord{};
}

/// Two robots in a small tunnel.
TEST(RosetteMission, ItsClosuresAreRight) {
  const mission::ServerRecord server = server_of({.model = "rosette", .rays_share = 0.5});  // half, for the test's time
  ASSERT_FALSE(server.updates.empty());
  const mission::MapUpdateRecord& end = server.updates.back();
  fmt::print("{} closures\n", end.closures);
  EXPECT_GT(end.closures, 3U);
  EXPECT_EQ(end.wrong, 0U);
}

}  // namespace rosette_mission_test
}  // namespace tutti::lab
