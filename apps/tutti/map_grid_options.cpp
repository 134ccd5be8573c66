// SPDX-License-Identifier: BSD-3-Clause
#include "map_grid_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "options.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/grids/map_grid.hpp"
#include "tutti/mapfile/export.hpp"
#include "tutti/mapfile/placement.hpp"

namespace tutti::app {

struct GridOptions {
  std::string grid, voxels;
  grids::MapGridConfig config;
  std::optional<double> body_height_m;
  double voxel_m = 0.2;
};

std::shared_ptr<GridOptions> add_grid_options(CLI::App& command) {
  auto options = std::make_shared<GridOptions>();
  grids::GridConfig& grid = options->config.grid;
  command
      .add_option("--grid", options->grid,
                  "A map to drive on, as nav2's map server reads it, with the image beside it: where something stands\n"
                  "between --low and --high above the ground, where nothing does, and what nobody knows.")
      ->type_name("FILE.yaml");
  command.add_option("--voxels", options->voxels, "The centre of every cube of space in which anything was seen.")
      ->type_name("FILE.ply");
  add_number(command, "--resolution", grid.resolution_m, "Edge of the grid's cells.", "M", within(0.01, 10.0));
  add_number(command, "--voxel", options->voxel_m, "Edge of the cubes.", "M", within(0.01, 100.0));
  add_number(command, "--low", grid.low_m, "Lower than this above the ground nothing is in the way.", "M",
             within(0.0, 100.0));
  add_number(command, "--high", grid.high_m, "Nor higher than this.", "M", within(0.0, 100.0));
  add_number(command, "--range", grid.range_m, "What is farther from a robot's way is not used.", "M",
             within(0.5, 1000.0));
  add_number(command, "--point", grid.point_m, "Edge of the voxels of submaps' clouds (agent.submap.voxel_m).", "M",
             within(0.0, 10.0));
  add_number(command, "--mate", grid.mate_m, "So far from where another robot was at the time points are its body.",
             "M", finite(true));
  add_number(command, "--body-height", options->body_height_m,
             "Of the robots' body frame above the ground; default: found in their clouds.", "M", within(0.0, 100.0));
  return options;
}

bool wants_grid(const GridOptions& options) { return !options.grid.empty() || !options.voxels.empty(); }

namespace {

Status write_grid(const storage::TableStore& map, const mapfile::Content& content, const server::MapEstimate& estimate,
                  const GridOptions& options) {
  grids::MapGridConfig config = options.config;
  config.body_height_m = options.body_height_m;
  const auto made = grids::grid_of_map(map, content, estimate, config);
  if (!made) return tl::unexpected(made.error());
  std::vector<std::string> notes;
  for (const auto& [chain, height] : made->body_height_m)
    notes.push_back(fmt::format("{}: {:.2f} m above the ground", content.closure_names().of(chain), height));
  notes.push_back(mapfile::in_words(made->T_level_world) +
                  " takes the world of the map, which .ply files of it are in, to this grid");
  notes.push_back(fmt::format("tilted from the map's world by {:.2f} deg, about its origin",
                              rotation_angle(made->T_level_world) / kRadPerDeg));
  if (const auto& earth = estimate.fixes.georeference) {
    const Eigen::Vector3d& t = earth->T_enu_world.translation;
    const Pose3 T_enu_level = earth->T_enu_world * made->T_level_world.inverse();
    const Eigen::Vector3d x = T_enu_level.rotation * Eigen::Vector3d::UnitX();
    notes.push_back(fmt::format("enu origin: latitude {:.9f}, longitude {:.9f}, height {:.3f} m (WGS 84)",
                                earth->origin.latitude_deg, earth->origin.longitude_deg, earth->origin.height_m));
    notes.push_back(
        fmt::format("the map's origin lies {:.3f} m east, {:.3f} m north, {:.3f} m up of it; its x axis {:.3f} "
                    "deg north of east",
                    t.x(), t.y(), t.z(), std::atan2(x.y(), x.x()) / kRadPerDeg));
  }
  if (auto ok = grids::write_nav2_map(made->grid, options.grid, notes); !ok) return ok;
  const grids::OccupancyGrid& grid = made->grid;
  fmt::print("{}: {} x {} cells of {} m, {} free, {} occupied; of {} submaps{}{}\n", options.grid, grid.width,
             grid.height, grid.resolution_m, grid.count(grids::OccupancyGrid::free),
             grid.count(grids::OccupancyGrid::occupied), made->submaps,
             made->left_out > 0 ? fmt::format("; {} are not tied to these", made->left_out) : "",
             made->mate_points > 0 ? fmt::format("; {} points are other robots", made->mate_points) : "");
  for (const std::string& note : notes) fmt::print("  {}\n", note);
  return {};
}

}  // namespace

int export_grids(const storage::TableStore& map, const mapfile::Content& content, const server::MapEstimate& estimate,
                 const GridOptions& options) {
  for (const std::string& file : {options.grid, options.voxels})
    if (auto made = make_folder_of(file); !made) return complain("map export", made.error().message);
  if (!options.grid.empty()) {
    if (options.config.grid.low_m >= options.config.grid.high_m)
      return complain("map export", "--low is not below --high", 2);
    if (auto ok = write_grid(map, content, estimate, options); !ok) return complain("map export", ok.error().message);
  }
  if (options.voxels.empty()) return 0;
  const auto voxels = grids::voxels_of_map(map, content, estimate, options.voxel_m, options.config.grid.mate_m);
  if (!voxels) return complain("map export", voxels.error().message);
  const Pose3 T_level_world = mapfile::level_frame(estimate, mapfile::component_to_show(content, estimate));
  if (auto ok = formats::write_ply(options.voxels, voxels->points, {}, {}, mapfile::world_comments(T_level_world)); !ok)
    return complain("map export", ok.error().message);
  fmt::print("{}: {} voxels of {} m\n", options.voxels, voxels->points.size(), options.voxel_m);
  return 0;
}

}  // namespace tutti::app
