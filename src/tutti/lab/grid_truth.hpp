// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tutti/grids/grid_builder.hpp"
#include "tutti/grids/map_grid.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/model/trajectory.hpp"

/// A map to drive on against the simulated world, which is known exactly.
namespace tutti::lab {

/// What is really in the slab of a cell.
enum class TrueCell : std::uint8_t {
  free,     ///< Nothing, anywhere in it.
  surface,  ///< A wall or a thing goes through it.
  rock      ///< It is all within one.
};

struct GridScore {
  static constexpr std::size_t kSaid = 3;                 ///< Free, occupied, unknown,
  std::array<std::array<std::size_t, 3>, kSaid> cells{};  ///< by TrueCell; within `near_m` of a way.
  std::size_t occupied_near_surface = 0;                  ///< Of those said occupied, with a surface in or beside it.
  [[nodiscard]] std::size_t of(grids::OccupancyGrid::Cell said, TrueCell real) const;
};

/// Looks at every `stride`th cell in both directions whose centre is within `near_m` of a robot's true way. The grid is
/// laid onto the truth by the one rigid motion that fits the map's keyframes to the robots' true poses best.
Result<GridScore> score_grid(const grids::MapGrid& made, const grids::GridConfig& config,
                             const server::MapEstimate& map, const MissionConfig& mission, std::uint64_t seed,
                             double near_m = 3.0, std::size_t stride = 1);

}  // namespace tutti::lab
