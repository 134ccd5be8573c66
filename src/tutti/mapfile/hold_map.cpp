// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/hold_map.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "tutti/mapfile/content.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/mapfile/placement.hpp"
#include "tutti/storage/map_tables.hpp"

namespace tutti::mapfile {

Result<std::size_t> hold_map(storage::TableStore& map) {
  const auto content = read(map);
  if (!content) return tl::unexpected(content.error());
  if (!content->held.empty()) return content->held.size();
  const server::MapEstimate made = estimate(*content);
  const std::uint32_t component = component_to_show(*content, made);
  Writer writer(map);
  std::size_t held = 0;
  for (const auto& [id, submap] : content->submaps) {
    std::vector<std::pair<std::uint32_t, Pose3>> poses;
    for (const Keyframe& keyframe : submap->keyframes)
      if (const MapNode* node = server::find_node(made, {id.chain, keyframe.index});
          node != nullptr && node->component == component)
        poses.emplace_back(keyframe.index, node->T_world_body);
    if (poses.empty()) continue;
    held += poses.size();
    if (auto ok = writer.put(node::to_row(id, poses)); !ok) return tl::unexpected(ok.error());
  }
  if (auto ok = writer.flush(); !ok) return tl::unexpected(ok.error());
  return held;
}

Result<std::size_t> copy_held(const std::filesystem::path& map, const std::filesystem::path& out) {
  const auto from = open_copy(map);
  if (!from) return tl::unexpected(from.error());
  Result<std::size_t> held = 0;
  const Status made = make_map(out, [&](storage::TableStore& to) -> Status {
    if (auto ok = copy_rows(**from, to); !ok) return ok;
    held = hold_map(to);
    return held ? Status() : Status(tl::unexpected(held.error()));
  });
  if (!made) return tl::unexpected(made.error());
  return held;
}

Result<HeldMap> read_held(const std::filesystem::path& map) {
  const auto from = open_copy(map);
  if (!from) return tl::unexpected(from.error());
  storage::MemoryStore copy(storage::map_schema());
  if (auto ok = copy_rows(**from, copy); !ok) return tl::unexpected(ok.error());
  if (auto held = hold_map(copy); !held) return tl::unexpected(held.error());
  const auto content = read(copy);
  if (!content) return tl::unexpected(content.error());
  HeldMap out{.rows = copy.tables(), .free_robot = RobotId{0}};
  for (const auto& [id, submap] : content->submaps)
    out.free_robot.value = std::max(out.free_robot.value, id.chain.robot.value + 1);
  return out;
}

}  // namespace tutti::mapfile
