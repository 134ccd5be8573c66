// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/map_changes.hpp"

#include "tutti/grids/internal/map_part.hpp"

namespace tutti::grids {

Result<Changes> changes_of_map(const storage::TableStore& store, const mapfile::Content& content,
                               const server::MapEstimate& map, const std::set<ChainId>& before,
                               const std::set<ChainId>& now, const ChangeConfig& config) {
  MapPart part(store, content, map);
  SeenSpace then(config), today(config);
  const auto seen = part.each(Pose3{}, [&](const ChainId& chain, const LevelSubmap& submap) {
    if (before.contains(chain)) then.add(submap);
    if (now.contains(chain)) today.add(submap);
  });
  if (!seen) return tl::unexpected(seen.error());
  for (const SeenSpace* one : {&then, &today})
    if (one->cubes().empty())
      return fail(ErrorCode::invalid, "the sessions {} have no clouds in the joint map, so nothing can be compared",
                  one == &then ? "before" : "since");
  return find_changes(then, today);
}

}  // namespace tutti::grids
