// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/grids/occupancy_grid.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::grids {

struct GridConfig {
  double resolution_m = 0.1;
  double low_m = 0.15;    ///< What stands in the way is between this
  double high_m = 1.5;    ///< and this above the ground.
  double range_m = 10.0;  ///< What is farther from the nearest pose of its submap is not used.
  double point_m = 0.3;  ///< Edge of the voxels to which submaps' clouds were thinned: a point stands for so much wall.
  double robot_m = 0.25;  ///< About a robot's way so much is free, as it was there.
  double mate_m = 0.7;    ///< So far from where another robot was at the time points are its body.
};

/// A submap in a level frame: z is up.
struct LevelSubmap {
  Trajectory keyframes;  ///< T_level_body
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3d> mates;  ///< Where others were while it was recorded.
};

/// The ground below a moment of a robot's way, level frame.
using Ground = Eigen::Vector3d;

/// Is a point of a submap another robot's body?
bool is_mate(const LevelSubmap& submap, const Eigen::Vector3d& point, double mate_m);

/// Collects submaps into a grid: each says once of a cell that something stands in the slab above its ground, or that
/// nothing does: where the ground itself was seen, and where rays pass through that slab from the nearest pose of the
/// submap to the voxel of a point, stopped by what stands in their way. The ground of a cell is that below the nearest
/// part of any robot's way. One map from above: of two floors above each other each cell has the nearer one's ground.
class GridBuilder {
 public:
  /// `ground`: of all robots' ways; at least one. An error: the grid would have too many cells.
  static Result<GridBuilder> create(const GridConfig& config, const std::vector<Ground>& ground);
  void add(const LevelSubmap& submap);
  /// A cell is occupied where at least every third of the submaps that know it says so, free where others do.
  [[nodiscard]] OccupancyGrid grid() const;

 private:
  struct Index {
    int x = 0, y = 0;
  };
  GridBuilder() = default;
  [[nodiscard]] Index index_of(double x, double y) const;
  [[nodiscard]] bool is_inside(Index at) const;
  [[nodiscard]] std::size_t flat(Index at) const {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(at.x);
  }
  void spread_ground(const std::vector<Ground>& ground);
  [[nodiscard]] bool is_in_slab(Index at, double z) const;
  template <class Visit>
  void around(const Eigen::Vector3d& point, const Visit& visit) const;
  void mark_way(const Trajectory& way);
  void mark_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  void mark(std::vector<std::uint32_t>& said, std::vector<std::uint16_t>& votes, Index at);

  GridConfig config_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int width_ = 0, height_ = 0;
  std::vector<float> ground_;                      ///< NaN where no way is near.
  std::vector<std::uint16_t> hits_, passes_;       ///< Submaps that say so.
  std::vector<std::uint32_t> hit_by_, passed_by_;  ///< The last submap that did.
  std::uint32_t submap_ = 0;
};

}  // namespace tutti::grids
