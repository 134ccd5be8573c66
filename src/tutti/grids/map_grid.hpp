// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "tutti/grids/grid_builder.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::grids {

/// What a grid of a map's file is made with.
struct MapGridConfig {
  GridConfig grid;
  std::optional<double> body_height_m;  ///< Of the robots' body frames above the ground; none: found in their clouds.
};

struct MapGrid {
  OccupancyGrid grid;
  Pose3 T_level_world;  ///< A rotation: the map's world has the tilt of the odometry that began it.
  std::map<ChainId, double> body_height_m;
  std::size_t submaps = 0;      ///< That it is made of,
  std::size_t left_out = 0;     ///< and with a cloud that is not in that part of the map.
  std::size_t mate_points = 0;  ///< Cut out as other robots' bodies.
};

/// The part of the map that mapfile::component_to_show() says, in a level frame with the origin of its world: up is
/// what the robots' bodies have for up on average. How high a body is above the ground is found for each session as
/// the distance below the body at which most points within 4 m are. Made from the submaps where they are now, so that
/// it follows every optimisation. Other robots' bodies are cut out of a submap's cloud within `mate_m` of where they
/// were while it was recorded, by stamps of one clock. An error: there are no clouds, or no ground is to be found.
Result<MapGrid> grid_of_map(const storage::TableStore& store, const mapfile::Content& content,
                            const server::MapEstimate& map, const MapGridConfig& config);

/// Centres of the voxels in which any point of that part of the map is, without other robots' bodies, in its world.
Result<PointCloud> voxels_of_map(const storage::TableStore& store, const mapfile::Content& content,
                                 const server::MapEstimate& map, double voxel_m, double mate_m);

}  // namespace tutti::grids
