// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tutti/formats/cloud_file.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::mapfile {

/// Writes the joint pose graph, odometry and accepted closures, as a mission's report does: vertices are numbered by
/// position, and beside "x.g2o" comes "x_stamps.csv" (formats/graph_stamps.hpp).
Status export_g2o(const server::MapEstimate& map, const std::filesystem::path& file);

/// Writes every session's T_world_body as FOLDER/NAME.tum, NAME as in closures' names, and makes the folder if it is
/// missing. Returns the files' names. Sessions in different components have unrelated worlds
/// (server::choose_components).
Result<std::vector<std::string>> export_tum(const Content& content, const server::MapEstimate& map,
                                            const std::filesystem::path& folder);

/// The clouds of all submaps in the component that component_to_show() names, in its world, thinned to voxels of 0.1 m.
struct JointCloud {
  std::uint32_t component = 0;
  PointCloud cloud;
  std::size_t submaps = 0;   ///< Submaps with a cloud, in the component.
  std::size_t left_out = 0;  ///< Submaps with a cloud that are not in the component.
};
Result<JointCloud> joint_cloud(const storage::TableStore& store, const Content& content,
                               const server::MapEstimate& map);

/// The comments of a PLY file in the map's world on its frame, and on that of the map's grids.
std::vector<std::string> world_comments(const Pose3& T_level_world);

struct ExportedCloud {
  std::size_t points = 0;
  std::size_t submaps = 0;
  std::size_t left_out = 0;    ///< Submaps with a cloud that are not in the component.
  bool of_the_largest = true;  ///< False: the largest component has no clouds, and this is the one with most points.
};
/// Writes joint_cloud() to a file; without points no file is written.
Result<ExportedCloud> export_cloud(const storage::TableStore& store, const Content& content,
                                   const server::MapEstimate& map, const std::filesystem::path& file,
                                   formats::CloudFormat format);

}  // namespace tutti::mapfile
