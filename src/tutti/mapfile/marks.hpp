// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/geometry/geodesy.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/map_mark.hpp"

/// Marks in a map's store: rows `mark/NUMBER` and `photo/NUMBER` of its table `meta` (docs/storage.md). Nothing of the
/// map follows from them, so whoever has the store open may change them.
namespace tutti::mapfile {

inline constexpr std::size_t kMostMarks = 500;  ///< In one map.

/// All marks. Rows that a newer program has written otherwise are left out. Fails when the table cannot be read.
Result<MarkSet> read_marks(const storage::TableStore& map);
/// A mark's photo; nothing when it has none.
Result<std::optional<std::string>> read_photo(const storage::TableStore& map, std::uint64_t number);

/// Stores a mark under a number that no other one has, the time at which it was given in ns or the next free one, and
/// returns that. `known` are the marks that the store has. Its photo_type follows from `photo`, which may be empty.
/// Errors of code `invalid`, which name what is wrong: a picture of another kind or size, words that are too long, a
/// place that is none, too many marks.
Result<std::uint64_t> put_mark(storage::TableStore& map, const MarkSet& known, MapMark& mark, const std::string& photo);
Status remove_mark(storage::TableStore& map, std::uint64_t number);

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
