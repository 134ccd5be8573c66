// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/grid_truth.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "tutti/lab/run_mission.hpp"

namespace tutti::lab {
namespace grid_truth_test {

using grids::OccupancyGrid;

/// A robot walks through two short corridors; its map is laid onto the world that it walked in.
TEST(GridTruth, AMapToDriveOnIsTheWorld) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.lidar.rays_share = 0.4;
  config.simulation.world.network = {.rows = 2, .columns = 2, .block_m = 15.0, .jitter_m = 2.0};
  config.simulation.robots.resize(1);
  config.simulation.robots[0].walk.duration_s = 30.0;
  std::optional<grids::MapGrid> made;
  std::optional<server::MapEstimate> map;
  mission::RunOptions options{.seed = 1, .threads = 1};
  options.keep_map = [&](const storage::TableStore& store) -> Status {
    const auto content = mapfile::read(store);
    if (!content) return tl::unexpected(content.error());
    map = mapfile::estimate(*content);
    auto grid = grids::grid_of_map(store, *content, *map, {});
    if (!grid) return tl::unexpected(grid.error());
    made = std::move(*grid);
    return {};
  };
  const auto record = run_mission(config, options);
  ASSERT_TRUE(record) << record.error().message;
  const auto score = score_grid(*made, {}, *map, config, 1);
  ASSERT_TRUE(score) << score.error().message;
  const auto total = [&](OccupancyGrid::Cell claimed) {
    return score->of(claimed, TrueCell::free) + score->of(claimed, TrueCell::surface) +
           score->of(claimed, TrueCell::rock);
  };
  const std::size_t said_free = total(OccupancyGrid::free), said_occupied = total(OccupancyGrid::occupied);
  EXPECT_GT(said_free, 2000U);
  EXPECT_LT(score->of(OccupancyGrid::free, TrueCell::rock), said_free / 100);  // 1 %
  EXPECT_GT(score->of(OccupancyGrid::free, TrueCell::free), 95 * said_free / 100);
  EXPECT_GT(score->occupied_near_surface, 70 * said_occupied / 100);
}

TEST(GridTruth, RecordingsHaveNone) {
  MissionConfig config;
  config.mission = "hku";
  EXPECT_EQ(score_grid({}, {}, {}, config, 1).error().message, "hku: source is 'recordings', expected 'simulation'");
}

}  // namespace grid_truth_test
}  // namespace tutti::lab
