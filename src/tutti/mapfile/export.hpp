// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tutti/mapfile/content.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::mapfile {

/// The joint pose graph, odometry and accepted closures, as a mission's report writes it: vertices are numbered by
/// their place, and beside "x.g2o" lies "x_stamps.csv" (formats/graph_stamps.hpp).
Status export_g2o(const server::MapEstimate& map, const std::filesystem::path& file);

/// Every session's trajectory in the joint map as FOLDER/NAME.tum, NAME as in closures' names; the folder is made.
/// Returns the files' names. Sessions that nothing ties together have unrelated frames (server::choose_components).
Result<std::vector<std::string>> export_tum(const Content& content, const server::MapEstimate& map,
                                            const std::filesystem::path& folder);

/// What all robots of a component saw (component_to_show()), in its frame, thinned to voxels of 0.1 m.
struct JointCloud {
  std::uint32_t component = 0;
  PointCloud cloud;
  std::size_t submaps = 0;   ///< With a cloud, in it,
  std::size_t left_out = 0;  ///< and not in it.
};
Result<JointCloud> joint_cloud(const storage::TableStore& store, const Content& content,
                               const server::MapEstimate& map);

struct ExportedCloud {
  std::size_t points = 0;
  std::size_t submaps = 0;
  std::size_t left_out = 0;    ///< Submaps with a cloud that are not in this component.
  bool of_the_largest = true;  ///< Component; otherwise that has no clouds, and this is the one with most points.
};
/// joint_cloud() as a file; none where nobody saw anything.
Result<ExportedCloud> export_ply(const storage::TableStore& store, const Content& content,
                                 const server::MapEstimate& map, const std::filesystem::path& file);

}  // namespace tutti::mapfile
