// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/map_grid.hpp"

#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"

namespace tutti::grids {
namespace map_grid_test {

/// Robots walk in circles on level ground, half a metre below them, which they see within 3 m; one point of each
/// submap is two metres above its first body, above all that a grid calls an obstacle, and is what voxels are counted
/// by.
class MapGrids : public testing::Test {
 protected:
  MapGrids() {
    mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, store_);
    for (const std::uint32_t robot : {0U, 1U})
      mapper.walk(ChainId(RobotId{robot}, 5), 1, [](const Submap& submap) {
        PointCloud cloud;
        for (float x = -3.0F; x <= 3.0F; x += 0.3F)
          for (float y = -3.0F; y <= 3.0F; y += 0.3F) cloud.points.emplace_back(x, y, -0.5F);
        cloud.points.emplace_back(0.0F, 0.0F, 2.0F + 0.01F * static_cast<float>(submap.id.index));
        return cloud;
      });
    content_ = mapfile::read(store_).value();
    map_ = mapfile::estimate(content_);
  }
  storage::MemoryStore store_{storage::map_schema()};
  mapfile::Content content_;
  server::MapEstimate map_;
};

TEST_F(MapGrids, TheGroundIsFoundAndWhereRobotsWereIsFree) {
  const auto made = grid_of_map(store_, content_, map_, {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->submaps, content_.submaps.size());
  ASSERT_EQ(made->body_height_m.size(), 2U);
  for (const auto& [chain, height] : made->body_height_m) EXPECT_NEAR(height, 0.5, 0.1);
  const OccupancyGrid& grid = made->grid;
  for (const auto& node : map_.nodes) {
    const Eigen::Vector3d at = made->T_level_world * node.T_world_body.translation;
    const Eigen::Vector2d cell = (at.head<2>() - grid.origin) / grid.resolution_m;
    EXPECT_EQ(grid.at(static_cast<std::size_t>(cell.x()), static_cast<std::size_t>(cell.y())), OccupancyGrid::free);
  }
  EXPECT_LT(10 * grid.count(OccupancyGrid::occupied), grid.count(OccupancyGrid::free));  // odometry strays up and down
  const auto given = grid_of_map(store_, content_, map_, {.grid = {}, .body_height_m = 0.7});
  EXPECT_EQ(given->body_height_m.begin()->second, 0.7);
}

TEST_F(MapGrids, VoxelsAreOfWhatWasSeen) {
  const PointCloud coarse = voxels_of_map(store_, content_, map_, 1.0, 0.0).value();
  const PointCloud fine = voxels_of_map(store_, content_, map_, 0.1, 0.0).value();
  EXPECT_LT(coarse.points.size(), fine.points.size());
  EXPECT_GT(coarse.points.size(), 20U);
  EXPECT_TRUE(voxels_of_map(store_, content_, map_, 0.1, 1e6).value().points.empty());  // all is another robot
}

}  // namespace map_grid_test
}  // namespace tutti::grids
