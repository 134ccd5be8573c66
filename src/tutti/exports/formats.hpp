// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "tutti/base/config.hpp"
#include "tutti/grids/map_grid.hpp"
#include "tutti/mapfile/content.hpp"

/// The results of a mission or a map, as files for other programs.
namespace tutti::exports {

/// A map's file, read and estimated.
struct MapSource {
  std::filesystem::path file;
  std::unique_ptr<storage::TableStore> store;
  mapfile::Content content;
  server::MapEstimate estimate;
  std::string why_copied;  ///< Why the file itself could not be opened, and a copy was; empty otherwise.
};
/// A copy of the map is read (mapfile::open_copy) with `live`, because a server may have it open or come to, and where
/// the file itself cannot be opened, as when a server has it.
Result<MapSource> open_map(const std::filesystem::path& file, bool live);

/// The settings of the formats; fields have the names of the options.
struct FormatSettings {
  grids::MapGridConfig grid;
  double voxel_m = 0.2;
  bool ros_only = false;  ///< MCAP files have no JSON (write_scene).
  template <class V>
  void describe(V& v) {
    v.field("resolution", grid.grid.resolution_m, between(0.01, 10.0), "Edge of the grid's cells.");
    v.field("voxel", voxel_m, between(0.01, 100.0), "Edge of the cubes.");
    v.field("low", grid.grid.low_m, between(0.0, 100.0), "Lower than this above the ground nothing is in the way.");
    v.field("high", grid.grid.high_m, between(0.0, 100.0), "Nor higher than this.");
    v.field("range", grid.grid.range_m, between(0.5, 1000.0), "What is farther from a robot's trajectory is not used.");
    v.field("point", grid.grid.point_m, between(0.0, 10.0),
            "Edge of the voxels of submaps' clouds (agent.submap.voxel_m).");
    v.field("mate", grid.grid.mate_m, at_least(0.0),
            "So far from where another robot was at the time points are its body.");
    v.field("body-height", grid.body_height_m, between(0.0, 100.0),
            "Height of the robots' body frame above the ground; default: found in their clouds.");
  }
};

/// A row of the table of formats. Both functions write `out`, maybe with files beside it, and return the report on it,
/// one or more lines. An error of code `configuration` is one of the settings.
struct Format {
  std::string_view name;    ///< The option --NAME writes this format, whatever the path ends in.
  std::string_view ending;  ///< How a path ends that is to be written in this format; "/": it is a folder.
  std::string_view help;
  using OfMap = Result<std::string>(const MapSource& map, const FormatSettings& settings,
                                    const std::filesystem::path& out);
  using OfRun = Result<std::string>(const std::filesystem::path& folder, const FormatSettings& settings,
                                    const std::filesystem::path& out);
  OfMap* of_map;
  OfRun* of_run;  ///< From a folder that `tutti run` has written; null: the folder lacks what the format needs.
};

/// All formats; where one ending is part of another, the longer one is first.
std::span<const Format> all_formats();
/// The format that the path's ending asks for; the error names all endings.
Result<const Format*> format_of(std::string_view path);

}  // namespace tutti::exports
