// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/meta_rows.hpp"

#include <algorithm>
#include <vector>

#include "tutti/node/meta_keys.hpp"

namespace tutti::mapfile {

const MetaRow& meta_row(std::string_view key) {
  using enum MetaRow::Of;
  static const std::vector<MetaRow> rows{
      {node::kMapKey},
      {node::kSettingsKey},
      {.key = node::kCountsKey, .merge_drops = true, .revert_drops = true},
      {.key = node::kLastUpdateKey, .merge_drops = true, .revert_drops = true},
      {node::kRobotPrefix, robot},
      {.key = node::kRefinementPrefix, .of = refinement, .merge_drops = true},
      {.key = node::kPlacePrefix, .of = place, .merge_drops = true},
      {node::kMarkPrefix},
      {node::kPhotoPrefix},
      {.key = node::kHeldPrefix, .of = submap, .merge_drops = true},
      {node::kRetiredPrefix, submap},
      {.key = node::kVersionPrefix, .of = version, .merge_drops = true},
      {.key = node::kRefusedPrefix, .renumber_drops = true},
      {.key = node::kReturnedPrefix, .merge_drops = true, .revert_drops = true, .renumber_drops = true},
  };
  static const MetaRow unknown;
  const auto is = [&](const MetaRow& row) {
    return row.key.ends_with('/') ? key.starts_with(row.key) : key == row.key;
  };
  const auto found = std::ranges::find_if(rows, is);
  return found == rows.end() ? unknown : *found;
}

}  // namespace tutti::mapfile
