// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/ros_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "tutti/bags/ros_encode.hpp"

namespace tutti::program {
namespace {

constexpr std::int8_t kUnknown = -1, kOccupied = 100;
constexpr double kLeastSeen = 0.5;  // of the grid's plane along the map's z axis: beyond 60 degrees nobody drives on it

std::array<std::int64_t, 2> cell_of(const Eigen::Vector2d& p, double resolution_m) {
  return {static_cast<std::int64_t>(std::floor(p.x() / resolution_m)),
          static_cast<std::int64_t>(std::floor(p.y() / resolution_m))};
}
Eigen::Vector2d centre(std::int64_t x, std::int64_t y, double resolution_m) {
  return resolution_m * Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
}

}  // namespace

std::string world_frame(const std::string& name, std::uint32_t component) {
  return component == 0 ? name : fmt::format("{}_{}", name, component + 1);
}

std::optional<std::uint32_t> component_of_frame(std::string_view frame, const std::string& name) {
  if (frame == name) return 0;
  if (!frame.starts_with(name + "_")) return std::nullopt;
  const std::string_view digits = frame.substr(name.size() + 1);
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_one = error == std::errc() && number >= 2 && frame == world_frame(name, number - 1);
  return is_one ? std::optional(number - 1) : std::nullopt;
}

Status RosGrid::take(std::string_view cdr) {
  const auto grid = bags::decode_occupancy_grid(cdr);
  if (!grid) return tl::unexpected(grid.error());
  if (std::uint64_t{grid->width} * grid->height > kMostCells)
    return fail(ErrorCode::unsupported, "a grid of {} x {} cells, expected at most {} cells", grid->width, grid->height,
                kMostCells);
  const Eigen::Vector3d& at = grid->origin.position;
  const double norm = grid->origin.orientation.norm();
  if (!(grid->resolution_m > 1e-3 && grid->resolution_m < 1e3) || !(at.norm() < 1e6) || !(std::abs(norm - 1.0) < 0.01))
    return fail(ErrorCode::invalid, "a grid with cells of {} m at {}, {}, {} with a quaternion of norm {}: no place",
                grid->resolution_m, at.x(), at.y(), at.z(), norm);
  frame_ = grid->header.frame_id;
  cells_.assign(grid->data.begin(), grid->data.end());
  resolution_m_ = grid->resolution_m;
  width_ = grid->width;
  height_ = grid->height;
  stamp_ = grid->header.stamp;
  T_world_grid_ = {grid->origin.orientation.normalized(), at};
  said_.reset();
  return {};
}

std::array<Eigen::Vector2d, 4> RosGrid::corners(const Plane& map_from_grid) const {
  const Eigen::Vector2d size = resolution_m_ * Eigen::Vector2d(width_, height_);
  return {map_from_grid({0.0, 0.0}), map_from_grid({size.x(), 0.0}), map_from_grid({0.0, size.y()}),
          map_from_grid(size)};
}

std::vector<std::int8_t> RosGrid::cells_in(const Plane& map_from_grid, const Eigen::Vector2d& least, std::int64_t width,
                                           std::int64_t height) const {
  const Plane grid_from_map = map_from_grid.inverse();
  std::vector<std::int8_t> out(static_cast<std::size_t>(width * height), kUnknown);
  for (std::int64_t y = 0; y < height; ++y)
    for (std::int64_t x = 0; x < width; ++x) {
      const auto [from_x, from_y] = cell_of(grid_from_map(least + centre(x, y, resolution_m_)), resolution_m_);
      if (from_x >= 0 && from_y >= 0 && from_x < width_ && from_y < height_)
        out[static_cast<std::size_t>(y * width + x)] = cells_[static_cast<std::size_t>(from_y * width_ + from_x)];
    }
  // Where cells are turned, a wall's may be missed by all new ones: what is occupied stays so.
  for (std::int64_t y = 0; y < height_; ++y)
    for (std::int64_t x = 0; x < width_; ++x) {
      if (cells_[static_cast<std::size_t>(y * width_ + x)] != kOccupied) continue;
      const auto [to_x, to_y] = cell_of(map_from_grid(centre(x, y, resolution_m_)) - least, resolution_m_);
      if (to_x >= 0 && to_y >= 0 && to_x < width && to_y < height)
        out[static_cast<std::size_t>(to_y * width + to_x)] = kOccupied;
    }
  return out;
}

Result<std::optional<std::string>> RosGrid::next(const std::string& frame, const Pose3& T_map_world,
                                                 const std::string& map_frame) {
  const std::optional<std::string> nothing;
  if (cells_.empty() || frame != frame_) return nothing;
  const Pose3 T_map_grid = T_map_world * T_world_grid_;
  const Plane map_from_grid{T_map_grid.rotation.toRotationMatrix().topLeftCorner<2, 2>(),
                            T_map_grid.translation.head<2>()};
  if (!(std::abs(map_from_grid.turn.determinant()) > kLeastSeen)) return nothing;
  const auto now = corners(map_from_grid);
  Eigen::Vector2d least = now[0], most = now[0];
  double moved_m = 0.0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    least = least.cwiseMin(now[i]);
    most = most.cwiseMax(now[i]);
    if (said_) moved_m = std::max(moved_m, (now[i] - (*said_)[i]).norm());
  }
  if (said_ && moved_m <= resolution_m_ / 2.0) return nothing;
  said_ = now;
  least = (least / resolution_m_).array().floor() * resolution_m_;
  const auto [width, height] = cell_of((most - least).array() + resolution_m_, resolution_m_);
  if (static_cast<double>(width) * static_cast<double>(height) > 2.0 * static_cast<double>(kMostCells))
    return fail(
        ErrorCode::unsupported,
        "the server's grid of {} x {} cells has {} x {} in the robot's map, where it is turned: expected at most {} "
        "cells",
        width_, height_, width, height, 2 * kMostCells);
  const std::vector<std::int8_t> cells = cells_in(map_from_grid, least, width, height);
  return std::optional(bags::encode(bags::RosOccupancyGrid{.header = {stamp_, map_frame},
                                                           .resolution_m = resolution_m_,
                                                           .width = static_cast<std::uint32_t>(width),
                                                           .height = static_cast<std::uint32_t>(height),
                                                           .origin = {{least.x(), least.y(), 0.0}},
                                                           .data = cells}));
}

}  // namespace tutti::program
