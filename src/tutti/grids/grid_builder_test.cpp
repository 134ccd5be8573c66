// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/grid_builder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace tutti::grids {
namespace grid_builder_test {

using Eigen::Vector3d, Eigen::Vector3f;

constexpr double kBody_m = 0.4;

/// A robot that drives from -3 to 3 along x in a room of 10 x 6 m, on a ground of any height.
LevelSubmap room(const std::function<double(double x)>& ground) {
  LevelSubmap out;
  for (int i = 0; i <= 12; ++i) {
    const double x = -3.0 + 0.5 * i;
    out.keyframes.push_back({Timestamp{i}, {Eigen::Quaterniond::Identity(), {x, 0.0, ground(x) + kBody_m}}});
  }
  const auto add = [&](double x, double y, double above) {
    out.points.emplace_back(Vector3d(x, y, ground(x) + above).cast<float>());
  };
  for (double along = -5.0; along <= 5.0; along += 0.25)
    for (double above = 0.05; above < 2.0; above += 0.25) {
      add(along, -3.0, above);
      add(along, 3.0, above);
      if (std::abs(along) > 3.0) continue;
      add(-5.0, along, above);
      add(5.0, along, above);
    }
  for (double x = -5.0; x <= 5.0; x += 0.25)
    for (double y = -3.0; y <= 3.0; y += 0.25) add(x, y, 0.0);
  return out;
}

std::vector<Ground> ground_below(const LevelSubmap& submap) {
  std::vector<Ground> out;
  for (const StampedPose& keyframe : submap.keyframes)
    out.push_back(keyframe.pose.translation - Vector3d(0.0, 0.0, kBody_m));
  return out;
}

OccupancyGrid grid_of(const LevelSubmap& submap, const GridConfig& config = {}) {
  GridBuilder builder = GridBuilder::create(config, ground_below(submap)).value();
  builder.add(submap);
  return builder.grid();
}

OccupancyGrid::Cell cell_at(const OccupancyGrid& grid, double x, double y) {
  const Eigen::Vector2d at = (Eigen::Vector2d(x, y) - grid.origin) / grid.resolution_m;
  return grid.at(static_cast<std::size_t>(at.x()), static_cast<std::size_t>(at.y()));
}

void expect_the_room(const OccupancyGrid& grid) {
  std::size_t inside = 0, known_free = 0;
  for (std::size_t y = 0; y < grid.height; ++y)
    for (std::size_t x = 0; x < grid.width; ++x) {
      const Eigen::Vector2d centre = grid.centre(x, y);
      const Eigen::Array2d to_wall = Eigen::Array2d(5.0, 3.0) - centre.array().abs();  // positive inside
      const OccupancyGrid::Cell cell = grid.at(x, y);
      if (to_wall.minCoeff() < -0.25) {
        ASSERT_EQ(cell, OccupancyGrid::unknown) << centre.transpose();
      }
      if (to_wall.minCoeff() > 0.25) {
        ASSERT_NE(cell, OccupancyGrid::occupied) << centre.transpose();
        ++inside;
        known_free += cell == OccupancyGrid::free ? 1 : 0;
      }
    }
  EXPECT_GT(static_cast<double>(known_free), 0.97 * static_cast<double>(inside));
  for (double along = -2.9; along < 3.0; along += 0.1)
    for (const auto& [x, y] :
         {std::pair{along, 3.0}, std::pair{along, -3.0}, std::pair{5.0, along}, std::pair{-5.0, along}})
      ASSERT_EQ(cell_at(grid, x, y), OccupancyGrid::occupied) << x << " " << y;
}

TEST(GridBuilder, ARoomIsFreeWithinItsWallsAndUnknownBehindThem) {
  expect_the_room(grid_of(room([](double) { return 7.0; })));
}

TEST(GridBuilder, TheGroundIsThatBelowTheTrajectory) {
  expect_the_room(grid_of(room([](double x) { return 0.06 * x; })));  // 0.6 m of slope are no wall
}

TEST(GridBuilder, RaysEndAtWhatBlocksThem) {
  LevelSubmap submap = room([](double) { return 0.0; });
  // Something behind the wall, as another pose may have seen it through a door: not from the pose nearest to it.
  for (double z = 0.1; z < 1.5; z += 0.1) submap.points.emplace_back(0.0F, 6.0F, static_cast<float>(z));
  const OccupancyGrid grid = grid_of(submap);
  EXPECT_EQ(cell_at(grid, 0.0, 6.0), OccupancyGrid::occupied);
  for (double y = 3.3; y < 5.7; y += 0.1) EXPECT_EQ(cell_at(grid, 0.05, y), OccupancyGrid::unknown) << y;
}

TEST(GridBuilder, OtherRobotsAreNoObstacles) {
  LevelSubmap submap = room([](double) { return 0.0; });
  for (double x = 0.8; x <= 1.2; x += 0.1)
    for (double z = 0.1; z < 0.8; z += 0.1) submap.points.emplace_back(Vector3d(x, 1.5, z).cast<float>());
  EXPECT_EQ(cell_at(grid_of(submap), 1.0, 1.5), OccupancyGrid::occupied);
  submap.mates = {{1.0, 1.5, kBody_m}};
  EXPECT_EQ(cell_at(grid_of(submap), 1.0, 1.5), OccupancyGrid::free);
  expect_the_room(grid_of(submap));
}

/// A sensor that a person carries sees that person, and goes up and down, so that the ground is an obstacle (HKU, real:
/// 9 % of its poses were on occupied cells).
TEST(GridBuilder, WhereARobotWasIsFreeWhateverWasSeenThere) {
  LevelSubmap submap = room([](double) { return 0.0; });
  const std::vector<Ground> ground = ground_below(submap);
  for (const StampedPose& keyframe : submap.keyframes)
    for (double z = 0.1; z < 0.8; z += 0.1)
      submap.points.emplace_back(
          Vector3d(keyframe.pose.translation.x(), keyframe.pose.translation.y(), z).cast<float>());
  GridBuilder builder = GridBuilder::create({}, ground).value();
  for (int i = 0; i < 5; ++i) builder.add(submap);
  for (const StampedPose& keyframe : submap.keyframes)
    EXPECT_EQ(cell_at(builder.grid(), keyframe.pose.translation.x(), keyframe.pose.translation.y()),
              OccupancyGrid::free);
}

TEST(GridBuilder, WhatOthersPassThroughIsFreeAgain) {
  LevelSubmap with = room([](double) { return 0.0; });
  const LevelSubmap without = with;
  for (double z = 0.1; z < 0.8; z += 0.1) with.points.emplace_back(Vector3d(1.0, 1.5, z).cast<float>());
  GridBuilder builder = GridBuilder::create({}, ground_below(with)).value();
  builder.add(with);
  builder.add(without);
  EXPECT_EQ(cell_at(builder.grid(), 1.0, 1.5), OccupancyGrid::occupied);
  for (int i = 0; i < 3; ++i) builder.add(without);
  EXPECT_EQ(cell_at(builder.grid(), 1.0, 1.5), OccupancyGrid::free);
}

TEST(GridBuilder, TooLargeGridsAreRefused) { EXPECT_FALSE(GridBuilder::create({}, {{0, 0, 0}, {1e6, 1e6, 0}})); }

}  // namespace grid_builder_test
}  // namespace tutti::grids
