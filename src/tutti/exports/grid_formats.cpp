// SPDX-License-Identifier: BSD-3-Clause
// Maps to drive on, of a map's file.
#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tutti/exports/formats.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mapfile/export.hpp"
#include "tutti/mapfile/placement.hpp"

namespace tutti::exports {
namespace {

std::vector<std::string> notes_of(const grids::MapGrid& made, const MapSource& map) {
  std::vector<std::string> notes;
  const std::uint32_t component = mapfile::component_to_show(map.content, map.estimate);
  if (auto warning = mapfile::disagreement_on_up(map.content, map.estimate, component))
    notes.push_back(std::move(*warning));
  for (const auto& [chain, height] : made.body_height_m)
    notes.push_back(fmt::format("{}: {:.2f} m above the ground", map.content.closure_names().of(chain), height));
  notes.push_back(mapfile::in_words(made.T_level_world) +
                  " takes the world of the map, which .ply files of it are in, to this grid");
  notes.push_back(fmt::format("tilted from the map's world by {:.2f} deg, about its origin",
                              rotation_angle(made.T_level_world) / kRadPerDeg));
  if (const auto& earth = map.estimate.fixes.georeference) {
    const Eigen::Vector3d& t = earth->T_enu_world.translation;
    const Pose3 T_enu_level = earth->T_enu_world * made.T_level_world.inverse();
    const Eigen::Vector3d x = T_enu_level.rotation * Eigen::Vector3d::UnitX();
    notes.push_back(fmt::format("enu origin: latitude {:.9f}, longitude {:.9f}, height {:.3f} m (WGS 84)",
                                earth->origin.latitude_deg, earth->origin.longitude_deg, earth->origin.height_m));
    notes.push_back(
        fmt::format("the map's origin lies {:.3f} m east, {:.3f} m north, {:.3f} m up of it; its x axis {:.3f} "
                    "deg north of east",
                    t.x(), t.y(), t.z(), std::atan2(x.y(), x.x()) / kRadPerDeg));
  }
  return notes;
}

}  // namespace

Result<std::string> write_grid(const MapSource& map, const FormatSettings& settings, const std::filesystem::path& out) {
  const grids::GridConfig& config = settings.grid.grid;
  if (config.low_m >= config.high_m)
    return fail(ErrorCode::configuration, "--low is {} and --high {}, expected --low below --high", config.low_m,
                config.high_m);
  const auto made = grids::grid_of_map(*map.store, map.content, map.estimate, settings.grid);
  if (!made) return tl::unexpected(made.error());
  std::vector<std::string> notes = notes_of(*made, map);
  notes.push_back(fmt::format("ground at {:.3f} m", made->ground_m));
  notes.push_back(fmt::format("component {} of the map", mapfile::component_to_show(map.content, map.estimate)));
  if (auto ok = grids::write_nav2_map(made->grid, out.string(), notes); !ok) return tl::unexpected(ok.error());
  const grids::OccupancyGrid& grid = made->grid;
  return fmt::format("{}: {} x {} cells of {} m, {} free, {} occupied; of {} submaps{}{}\n  {}", out.string(),
                     grid.width, grid.height, grid.resolution_m, grid.count(grids::OccupancyGrid::free),
                     grid.count(grids::OccupancyGrid::occupied), made->submaps,
                     made->left_out > 0 ? fmt::format("; {} are not tied to these", made->left_out) : "",
                     made->mate_points > 0 ? fmt::format("; {} points are other robots", made->mate_points) : "",
                     fmt::join(notes, "\n  "));
}

Result<std::string> write_voxels(const MapSource& map, const FormatSettings& settings,
                                 const std::filesystem::path& out) {
  const auto voxels =
      grids::voxels_of_map(*map.store, map.content, map.estimate, settings.voxel_m, settings.grid.grid.mate_m);
  if (!voxels) return tl::unexpected(voxels.error());
  const Pose3 T_level_world = mapfile::level_frame(map.estimate, mapfile::component_to_show(map.content, map.estimate));
  return formats::write_ply(out.string(), voxels->points, {}, {}, mapfile::world_comments(T_level_world)).map([&] {
    return fmt::format("{}: {} voxels of {} m", out.string(), voxels->points.size(), settings.voxel_m);
  });
}

}  // namespace tutti::exports
