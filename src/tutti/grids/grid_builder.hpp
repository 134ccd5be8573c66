// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/grids/occupancy_grid.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::grids {

/// How GridBuilder decides what is occupied.
struct GridConfig {
  double resolution_m = 0.1;
  double low_m = 0.15;    ///< An obstacle is at least this high above the ground,
  double high_m = 1.5;    ///< and not above this height.
  double range_m = 10.0;  ///< Points farther, seen from above, from the nearest pose of their submap are not used.
  /// Edge of the voxels to which submaps' clouds were thinned: a point stands for this much wall.
  double point_m = 0.3;
  double robot_m = 0.25;  ///< Radius around a robot's trajectory that is free, because the robot was there.
  double mate_m = 0.7;    ///< Points this near to where another robot was at the time are taken for that robot's body.
};

/// A submap in a level frame: z is up.
struct LevelSubmap {
  Trajectory keyframes;  ///< T_level_body
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3d> mates;  ///< Positions of other robots while it was recorded, level frame.
};

/// A point of the ground below a robot's trajectory, level frame.
using Ground = Eigen::Vector3d;

/// The pose of the submap, which has one, that is nearest to a point (level frame).
const Pose3& nearest_pose(const LevelSubmap& submap, const Eigen::Vector3d& point);
/// True for a point (level frame) of another robot's body.
bool is_mate(const LevelSubmap& submap, const Eigen::Vector3d& point, double mate_m);

/// Collects submaps into an occupancy grid. A submap votes at most once on a cell that something stands in the slab
/// [low_m, high_m] above the cell's ground, and at most once that nothing does. Votes for free come from ground that
/// was seen and from rays through the slab, from the nearest pose of the submap to the voxel of a point; a ray ends
/// where the same submap has an obstacle. The ground of a cell is that below the nearest part of any robot's
/// trajectory, so of two floors above each other a cell gets the nearer one.
class GridBuilder {
 public:
  /// `ground`: points below all robots' trajectories, at least one. A grid of more than 4e8 cells is an error.
  static Result<GridBuilder> create(const GridConfig& config, const std::vector<Ground>& ground);
  void add(const LevelSubmap& submap);
  /// The grid of all submaps so far: a cell is free where a robot was, whatever was seen there, since its stack plans
  /// from where it is; occupied where at least one in three votes is for that, free where there are other votes, and
  /// unknown elsewhere.
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
  void mark_trajectory(const Trajectory& trajectory);
  void mark_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  void mark(std::vector<std::uint32_t>& marked_by, std::vector<std::uint16_t>& votes, Index at);

  GridConfig config_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int width_ = 0, height_ = 0;
  std::vector<float> ground_;  ///< Height of each cell's ground, level frame; NaN where no trajectory is near.
  std::vector<std::uint16_t> hits_, passes_;       ///< Votes of submaps, per cell.
  std::vector<std::uint32_t> hit_by_, passed_by_;  ///< The last submap that voted, per cell.
  std::vector<bool> driven_;                       ///< A robot was there, per cell.
  std::uint32_t submap_ = 0;
};

}  // namespace tutti::grids
