// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/geometry/geodesy.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/map_mark.hpp"

/// Where the marks of a map (node/marks.hpp) are.
namespace tutti::mapfile {

/// Where a mark is in the map, and how sure that is.
struct PlacedMark {
  std::uint64_t number = 0;
  std::uint32_t component = 0;
  Eigen::Vector3d at;  ///< In the component's world, m.
  /// `at`'s, in the axes of the world, m^2: that of the pose of the submap's middle keyframe, with the mark's lever arm
  /// from there, seen from the first keyframe of the component; from the earth where fixes lay the component on it.
  /// Nothing: the map does not determine it.
  std::optional<Eigen::Matrix3d> covariance;
  std::optional<Geodetic> on_earth;
};
/// By number; marks whose submaps are not in the map are left out.
std::vector<PlacedMark> place_marks(const MarkSet& marks, const Content& content, const server::MapEstimate& map);

/// A table of all marks (docs/operating.md describes its columns), and their photos beside it as NAME_NUMBER.jpg or
/// .png.
struct ExportedMarks {
  std::size_t marks = 0;
  std::size_t photos = 0;
  std::size_t left_out = 0;  ///< Marks in submaps that are not in the map.
};
Result<ExportedMarks> export_marks(const storage::TableStore& store, const Content& content,
                                   const server::MapEstimate& map, const std::filesystem::path& file);

}  // namespace tutti::mapfile
