// SPDX-License-Identifier: BSD-3-Clause
// Closures from scans that have hardly a ray in common, as those of a Livox Mid-360.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tutti/lab/run_mission.hpp"

namespace tutti::lab {
namespace rosette_mission_test {

mission::ServerRecord server_of(const simulation::LidarConfig& lidar) {
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
  simulation::LidarConfig mid360;
  mid360.pattern = "rosette";
  mid360.beams = 4;
  mid360.lowest_deg = -7.0;
  mid360.highest_deg = 52.0;
  mid360.points_per_s = 100'000.0;  // half of it, for the test's time
  const mission::ServerRecord server = server_of(mid360);
  ASSERT_FALSE(server.updates.empty());
  const mission::MapUpdateRecord& end = server.updates.back();
  fmt::print("{} closures\n", end.closures);
  EXPECT_GT(end.closures, 3U);
  EXPECT_EQ(end.wrong, 0U);
}

}  // namespace rosette_mission_test
}  // namespace tutti::lab
