// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tutti/grids/map_grid.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/ros/dds.hpp"
#include "tutti/program/server_program.hpp"

namespace tutti::ros {

/// How a server's map is published on topics of ROS 2.
struct RosServerOptions {
  std::string name_space = "world";
  /// Frame of both topics, program::world_frame() of it: the world of the component that is shown. The grid is a plane
  /// in it, where the ground is, which info.origin turns level.
  std::string frame = "world";
  double period_s = 5.0;  ///< Least wall time between two maps; a map that takes long to make is followed by a pause of
                          ///< nine times as long.
  double voxel_m = 0.2;   ///< Edge of the voxels of `map_points`.
  grids::MapGridConfig grid;
  std::function<void(program::Level, const std::string&)> say;
};

/// Publishes the largest component of the server's map as it grows, latched for late subscribers: `map_points`
/// (PointCloud2 with x y z, the centres of occupied voxels) and `map` (OccupancyGrid). Fails when the names are invalid
/// or the topics cannot be opened.
Result<std::unique_ptr<program::MapViewer>> view_on_ros(const RosServerOptions& options,
                                                        std::shared_ptr<Participant> participant,
                                                        const storage::TableStore& map);

}  // namespace tutti::ros
