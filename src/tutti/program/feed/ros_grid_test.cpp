// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/ros_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tutti/bags/ros_encode.hpp"

namespace tutti::program {
namespace ros_grid_test {

constexpr std::int8_t kFree = 0, kOccupied = 100, kUnknown = -1;

Pose3 turned(double yaw, double x, double y) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, y, 0.0}};
}

/// A room of 6 m x 4 m whose corner is at (-1, -1), with walls of one cell of 0.1 m.
struct Room {
  std::vector<std::int8_t> cells = std::vector<std::int8_t>(60 * 40, kFree);
  Room() {
    for (std::size_t x = 0; x < 60; ++x) cells[x] = cells[39 * 60 + x] = kOccupied;
    for (std::size_t y = 0; y < 40; ++y) cells[y * 60] = cells[y * 60 + 59] = kOccupied;
  }
  [[nodiscard]] std::string message(const std::string& frame = "world") const {
    return bags::encode(bags::RosOccupancyGrid{.header = {{7}, frame},
                                               .resolution_m = 0.1,
                                               .width = 60,
                                               .height = 40,
                                               .origin = {{-1.0, -1.0, 0.0}},
                                               .data = cells});
  }
};

std::int8_t at(const bags::RosOccupancyGrid& grid, double x, double y) {
  const auto column = static_cast<std::int64_t>(std::floor((x - grid.origin.position.x()) / grid.resolution_m)),
             row = static_cast<std::int64_t>(std::floor((y - grid.origin.position.y()) / grid.resolution_m));
  if (column < 0 || row < 0 || column >= grid.width || row >= grid.height) return kUnknown;
  return grid.data[static_cast<std::size_t>(row * grid.width + column)];
}

TEST(RosGrid, IsTheSameRoomInTheRobotsOwnMap) {
  const Room room;
  for (const double yaw : {0.0, 0.3, M_PI / 4, -2.0}) {
    RosGrid grid;
    ASSERT_TRUE(grid.take(room.message()));
    const Pose3 T_world_map = turned(yaw, 2.0, -3.0);
    const auto bytes = grid.next("world", T_world_map.inverse(), "alpha/map").value();
    ASSERT_TRUE(bytes);
    const auto made = bags::decode_occupancy_grid(*bytes).value();
    EXPECT_EQ(made.header.frame_id, "alpha/map");
    std::size_t free = 0, walls = 0;
    for (double x = -2.0; x < 6.0; x += 0.05)
      for (double y = -2.0; y < 4.0; y += 0.05) {
        const Eigen::Vector3d p_map = T_world_map.inverse() * Eigen::Vector3d(x, y, 0.0);
        const std::int8_t cell = at(made, p_map.x(), p_map.y());
        const double to_wall = std::min({x + 1.0, 5.0 - x, y + 1.0, 3.0 - y});
        free += cell == kFree ? 1 : 0;
        if (std::abs(to_wall) < 0.3) continue;
        EXPECT_EQ(cell, to_wall > 0.0 ? kFree : kUnknown) << yaw << " " << x << " " << y;
      }
    for (const std::int8_t cell : made.data) walls += cell == kOccupied ? 1 : 0;
    EXPECT_GT(free, 1000U);
    EXPECT_GE(walls, 138U) << yaw;  // of 196 cells; at 45 degrees two of them may fall into one
  }
}

TEST(RosGrid, IsSentAgainWhenItIsAnotherOne) {
  const Room room;
  RosGrid grid;
  EXPECT_FALSE(grid.next("world", {}, "map").value());
  ASSERT_TRUE(grid.take(room.message()));
  EXPECT_FALSE(grid.next("world_1", {}, "map").value()) << "of another component";
  EXPECT_TRUE(grid.next("world", {}, "map").value());
  EXPECT_FALSE(grid.next("world", turned(0.001, 0.01, 0.0), "map").value()) << "less than half a cell";
  EXPECT_TRUE(grid.next("world", turned(0.0, 0.06, 0.0), "map").value());
  EXPECT_TRUE(grid.next("world", turned(0.02, 0.06, 0.0), "map").value());
  EXPECT_FALSE(grid.next("world", turned(0.02, 0.06, 0.0), "map").value());
  ASSERT_TRUE(grid.take(room.message()));
  EXPECT_TRUE(grid.next("world", turned(0.02, 0.06, 0.0), "map").value()) << "the server's is new";
}

TEST(RosGrid, WhatIsNoneIsRefused) {
  RosGrid grid;
  const Room room;
  const auto why = [&](const bags::RosOccupancyGrid& made) { return grid.take(bags::encode(made)).error().message; };
  EXPECT_NE(grid.take(room.message().substr(0, 100)).error().message.find("data wants"), std::string::npos);
  const bags::RosOccupancyGrid made{
      .header = {{}, "world"}, .resolution_m = 0.1, .width = 60, .height = 40, .data = room.cells};
  auto other = made;
  other.width = 61;
  EXPECT_NE(why(other).find("2400 cells, expected 61 x 40"), std::string::npos);
  other = made;
  other.resolution_m = 0.0;
  EXPECT_NE(why(other).find("no place"), std::string::npos);
  other = made;
  other.origin.orientation.coeffs().setZero();
  EXPECT_NE(why(other).find("no place"), std::string::npos);
  EXPECT_FALSE(grid.next("world", {}, "map").value());
}

/// A row of cells seen at 45 degrees is a square of half its length.
TEST(RosGrid, ALongOneThatIsTurnedTakesNoMemory) {
  RosGrid grid;
  const std::vector<std::int8_t> cells(RosGrid::kMostCells, kFree);
  ASSERT_TRUE(grid.take(bags::encode(bags::RosOccupancyGrid{.header = {{7}, "world"},
                                                            .resolution_m = 0.1,
                                                            .width = 8,
                                                            .height = static_cast<std::uint32_t>(cells.size() / 8),
                                                            .data = cells})));
  const auto turned_one = grid.next("world", turned(M_PI / 4, 0.0, 0.0), "map");
  ASSERT_FALSE(turned_one.has_value());
  EXPECT_NE(turned_one.error().message.find("expected at most 16000000 cells"), std::string::npos)
      << turned_one.error().message;
  EXPECT_FALSE(grid.next("world", turned(M_PI / 4, 0.0, 0.0), "map").value()) << "said once";
  EXPECT_TRUE(grid.next("world", {}, "map").value()) << "as it lies there is room for it";
}

/// The world has the tilt of the odometry that began it, and its origin may be far above a robot's.
TEST(RosGrid, IsWhereItIsSeenInATiltedWorld) {
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.05, Eigen::Vector3d(1, 2, 0).normalized()));
  const Pose3 T_level_world{tilt, Eigen::Vector3d::Zero()};
  const Room room;
  const Pose3 T_level_corner{Eigen::Quaterniond::Identity(), {-1.0, -1.0, 50.0}};
  RosGrid grid;
  ASSERT_TRUE(
      grid.take(bags::encode(bags::RosOccupancyGrid{.header = {{7}, "world"},
                                                    .resolution_m = 0.1,
                                                    .width = 60,
                                                    .height = 40,
                                                    .origin = bags::to_ros(T_level_world.inverse() * T_level_corner),
                                                    .data = room.cells})));
  const Pose3 T_map_level = turned(0.0, 3.0, 7.0);
  const auto made =
      bags::decode_occupancy_grid(grid.next("world", T_map_level * T_level_world, "map").value().value()).value();
  EXPECT_LT((made.origin.position.head<2>() - Eigen::Vector2d(2.0, 6.0)).norm(), 0.15);
  EXPECT_EQ(at(made, 5.0, 8.0), kFree);
  EXPECT_EQ(world_frame("world", 0), "world");
  EXPECT_EQ(world_frame("world", 1), "world_2");
  for (const std::uint32_t component : {0U, 1U, 9U, 4'294'967'294U})
    EXPECT_EQ(component_of_frame(world_frame("world", component), "world"), component);
  for (const char* const other :
       {"", "map", "world_", "world_0", "world_1", "world_02", "world_2x", "world_-2", "world_4294967296", "world2"})
    EXPECT_FALSE(component_of_frame(other, "world").has_value()) << other;
}

}  // namespace ros_grid_test
}  // namespace tutti::program
