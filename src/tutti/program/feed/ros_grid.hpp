// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::program {

/// The frame of ROS that stands for the world of one component of the server's map: "world" of component 0, "world_2"
/// of component 1 (the second floor of a map that does not move), because poses of two components must not be compared.
std::string world_frame(const std::string& name, std::uint32_t component);
/// The component whose frame this is; nothing when it is none.
std::optional<std::uint32_t> component_of_frame(std::string_view frame, const std::string& name);

/// A server's grid (nav_msgs/OccupancyGrid in a world's frame) as a robot drives by it: in the frame of its own map.
class RosGrid {
 public:
  static constexpr const char* kType = "nav_msgs/msg/OccupancyGrid";
  static constexpr std::uint64_t kMostCells =
      8'000'000;  // turned by 45 degrees it has twice as many, and a message 16 MiB

  /// Takes a grid of the server; `next()` has it then. Fails when it is none, or too large.
  Status take(std::string_view cdr);
  /// The grid in `map_frame`, axis by axis, seen along the map's z axis, if it is another than before: the server has
  /// made a new one, or the map has moved in the world by more than half a cell at a corner. Nothing while the grid is
  /// of another world than `frame`. Fails, once for each place, when turned it would have more than 2 * kMostCells
  /// cells, as a long and narrow one has.
  Result<std::optional<std::string>> next(const std::string& frame, const Pose3& T_map_world,
                                          const std::string& map_frame);

 private:
  /// From a place on the grid to the map's x and y.
  struct Plane {
    Eigen::Matrix2d turn;
    Eigen::Vector2d shift;
    Eigen::Vector2d operator()(const Eigen::Vector2d& p) const { return turn * p + shift; }
    [[nodiscard]] Plane inverse() const { return {turn.inverse(), -(turn.inverse() * shift)}; }
  };
  [[nodiscard]] std::array<Eigen::Vector2d, 4> corners(const Plane& map_from_grid) const;
  [[nodiscard]] std::vector<std::int8_t> cells_in(const Plane& map_from_grid, const Eigen::Vector2d& least,
                                                  std::int64_t width, std::int64_t height) const;

  std::string frame_;
  std::vector<std::int8_t> cells_;
  double resolution_m_ = 0.0;
  std::int64_t width_ = 0, height_ = 0;
  Timestamp stamp_;
  Pose3 T_world_grid_;
  std::optional<std::array<Eigen::Vector2d, 4>> said_;  ///< The corners of what was sent on.
};

}  // namespace tutti::program
