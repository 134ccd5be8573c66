// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

/// Occupancy grids, and files of them for nav2.
namespace tutti::grids {

/// A grid seen from above, with the values of nav_msgs/OccupancyGrid.
struct OccupancyGrid {
  enum Cell : std::int8_t { unknown = -1, free = 0, occupied = 100 };
  double resolution_m = 0.1;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< Corner of the first cell with the least x and y, m.
  std::size_t width = 0, height = 0;
  std::vector<Cell> cells;  ///< height * width cells, row by row from the least y on, each row from the least x.

  [[nodiscard]] Cell at(std::size_t x, std::size_t y) const { return cells[y * width + x]; }
  [[nodiscard]] Eigen::Vector2d centre(std::size_t x, std::size_t y) const {
    return origin + resolution_m * Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
  }
  [[nodiscard]] std::size_t count(Cell cell) const;
};

/// Writes the grid for nav2's map server: FILE.yaml and, beside it, FILE.pgm. `notes` become comments in the yaml.
Status write_nav2_map(const OccupancyGrid& grid, const std::string& yaml_path, const std::vector<std::string>& notes);

}  // namespace tutti::grids
