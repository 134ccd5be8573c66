// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

/// Each row of table `meta` has a line here, by which all that copies maps keeps it, changes it or leaves it out.
namespace tutti::mapfile {

struct MetaRow {
  enum class Of { map, robot, submap, place, refinement, version };  ///< Named by the key, after its prefix.
  std::string_view key;                                              ///< A prefix when it ends with a slash.
  Of of = Of::map;
  bool merge_drops = false;     ///< It is about one map alone, or is joined by merge() itself.
  bool revert_drops = false;    ///< It is about the map as it was.
  bool renumber_drops = false;  ///< It names robots, and is made again.
};

/// Its line; without a key for a row of a newer program, which is copied as it is.
[[nodiscard]] const MetaRow& meta_row(std::string_view key);

}  // namespace tutti::mapfile
