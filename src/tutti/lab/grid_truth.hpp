// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tutti/grids/grid_builder.hpp"
#include "tutti/grids/map_grid.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/model/trajectory.hpp"

/// Scores an occupancy grid against the simulated world, which is known exactly.
namespace tutti::lab {

/// The true content of the slab of a cell in the simulated world.
enum class TrueCell : std::uint8_t {
  free,     ///< Nothing.
  surface,  ///< A wall or an object cuts it.
  rock      ///< All of it is inside one.
};

/// How many cells are what the grid has them as, counted near the robots' trajectories.
struct GridScore {
  static constexpr std::size_t kGridStates = 3;                 ///< In the grid: free, occupied or unknown,
  std::array<std::array<std::size_t, 3>, kGridStates> cells{};  ///< then what is true (TrueCell).
  std::size_t occupied_near_surface = 0;  ///< Cells occupied in the grid that have a surface in or beside them.
  [[nodiscard]] std::size_t of(grids::OccupancyGrid::Cell claimed, TrueCell real) const;
};

/// Examines every `stride`-th cell in both directions whose centre is within `near_m` of a robot's true trajectory. The
/// grid is aligned with the truth by one rigid motion, fitted to the map's keyframes and the robots' true poses.
Result<GridScore> score_grid(const grids::MapGrid& made, const grids::GridConfig& config,
                             const server::MapEstimate& map, const MissionConfig& mission, std::uint64_t seed,
                             double near_m = 3.0, std::size_t stride = 1);

}  // namespace tutti::lab
