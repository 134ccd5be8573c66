// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "tutti/grids/grid_builder.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::grids {

/// How a grid of a map's file is made.
struct MapGridConfig {
  GridConfig grid;
  std::optional<double> body_height_m;  ///< Height of the body frames above the ground; no value: found in the clouds.
};

struct MapGrid {
  OccupancyGrid grid;
  Pose3 T_level_world;    ///< A rotation, because the map's world has the tilt of the odometry that began it.
  double ground_m = 0.0;  ///< Mean height of the ground below all trajectories, in the level frame.
  std::map<ChainId, double> body_height_m;
  std::size_t submaps = 0;      ///< Submaps that the grid is made of.
  std::size_t left_out = 0;     ///< Submaps with a cloud that are not in the component.
  std::size_t mate_points = 0;  ///< Points cut out as other robots' bodies.
};

/// The occupancy grid of the component that mapfile::component_to_show() names, in a level frame with the origin of its
/// world: up is the mean z axis of the robots' bodies. Unless config.body_height_m states it, the height of a session's
/// body above the ground is the depth below the body at which most of its points within 4 m are. The grid is made from
/// the submaps at their present poses, so a new one follows every optimisation. Other robots' bodies are cut out of a
/// submap's cloud within `mate_m` of where they were while it was recorded, which takes stamps of one clock. Errors:
/// there are no clouds, or no ground can be found.
Result<MapGrid> grid_of_map(const storage::TableStore& store, const mapfile::Content& content,
                            const server::MapEstimate& map, const MapGridConfig& config);

/// Centres of the voxels (edge `voxel_m`) that contain points of that component, without other robots' bodies, in its
/// world, m.
Result<PointCloud> voxels_of_map(const storage::TableStore& store, const mapfile::Content& content,
                                 const server::MapEstimate& map, double voxel_m, double mate_m);

}  // namespace tutti::grids
