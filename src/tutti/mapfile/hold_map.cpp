// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/hold_map.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/mapfile/content.hpp"
#include "tutti/mapfile/floors.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/mapfile/renumber.hpp"
#include "tutti/mapfile/versions.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"

namespace tutti::mapfile {
namespace {

/// The components that are held, and the number of each one's floor: those that are already, and all that are floors.
std::map<std::uint32_t, std::uint32_t> floors_to_hold(const Content& content, const server::MapEstimate& made) {
  std::map<std::uint32_t, std::vector<KeyframeId>> nodes;
  for (const MapNode& node : made.nodes) nodes[node.component].push_back(node.id);
  std::uint32_t next = 0;
  for (const auto& [id, pose] : content.held) next = std::max(next, pose.floor + 1);
  const Floors floors = Floors::of(content, made);
  std::map<std::uint32_t, std::uint32_t> out;
  for (const auto& [component, ids] : nodes)
    if (const auto floor = server::main_floor(content.held, ids))
      out.emplace(component, *floor);
    else if (floors.of_component(component))
      out.emplace(component, next++);
  return out;
}

/// New numbers for the sessions of robots that were in the map before under another number.
Result<std::map<ChainId, ChainId>> sessions_of_known_robots(const HeldMap& before, const storage::TableStore& map) {
  const auto names = node::read_robot_names(map);
  if (!names) return tl::unexpected(names.error());
  std::map<std::string, RobotId> known;
  for (const auto& [robot, name] : *names)
    if (robot < before.free_robot) known.emplace(name, robot);
  std::map<RobotId, std::uint64_t> sessions;  // the newest of each robot
  std::set<ChainId> added;
  const auto visit = [&](std::string_view key, std::size_t) {
    const auto id = node::submap_of_key(key);
    if (!id) return;
    std::uint64_t& newest = sessions[id->chain.robot];
    newest = std::max(newest, id->chain.session);
    if (id->chain.robot >= before.free_robot) added.insert(id->chain);
  };
  if (auto sized = map.sizes(map_tables::kSubmaps, visit); !sized) return tl::unexpected(sized.error());
  std::map<ChainId, ChainId> out;
  for (const ChainId& chain : added) {
    const auto name = names->find(chain.robot);
    const auto robot = name != names->end() ? known.find(name->second) : known.end();
    if (robot == known.end()) continue;
    const auto newest = sessions.find(robot->second);
    out.emplace(chain, ChainId(robot->second, newest == sessions.end() ? 0 : ++newest->second));
  }
  return out;
}

}  // namespace

Result<std::size_t> hold_map(storage::TableStore& map, std::int64_t now_ns) {
  const auto content = read(map);
  if (!content) return tl::unexpected(content.error());
  auto all = versions(map);
  if (!all) return tl::unexpected(all.error());
  const server::MapEstimate made = estimate(*content);
  const std::map<std::uint32_t, std::uint32_t> floors = floors_to_hold(*content, made);
  Writer writer(map);
  std::set<KeyframeId> held;  // neighbouring submaps share one
  for (const auto& [id, submap] : content->submaps) {
    std::vector<std::pair<std::uint32_t, server::HeldPose>> poses;
    for (const Keyframe& keyframe : submap->keyframes) {
      const MapNode* node = server::find_node(made, {id.chain, keyframe.index});
      const auto floor = node != nullptr ? floors.find(node->component) : floors.end();
      if (floor == floors.end()) continue;
      poses.emplace_back(keyframe.index, server::HeldPose{node->T_world_body, floor->second});
      held.insert(node->id);
    }
    if (poses.empty()) continue;
    if (auto ok = writer.put(node::to_row(id, poses)); !ok) return tl::unexpected(ok.error());
  }
  if (Version& newest = all->back(); newest.held_ns == 0 && !held.empty()) {
    newest.held_ns = now_ns;
    if (auto ok = writer.put(to_row(newest)); !ok) return tl::unexpected(ok.error());
  }
  if (auto ok = writer.flush(); !ok) return tl::unexpected(ok.error());
  return held.size();
}

Result<std::size_t> copy_held(const std::filesystem::path& map, const std::filesystem::path& out, std::int64_t now_ns) {
  const auto from = open_copy(map);
  if (!from) return tl::unexpected(from.error());
  Result<std::size_t> held = 0;
  const Status made = make_map(out, [&](storage::TableStore& to) -> Status {
    if (auto ok = copy_rows(**from, to); !ok) return ok;
    held = hold_map(to, now_ns);
    return held ? Status() : Status(tl::unexpected(held.error()));
  });
  if (!made) return tl::unexpected(made.error());
  return held;
}

Result<HeldMap> read_held(const std::filesystem::path& map, std::int64_t now_ns) {
  const auto from = open_copy(map);
  if (!from) return tl::unexpected(from.error());
  storage::MemoryStore copy(storage::map_schema());
  if (auto ok = copy_rows(**from, copy); !ok) return tl::unexpected(ok.error());
  if (auto held = hold_map(copy, now_ns); !held) return tl::unexpected(held.error());
  HeldMap out{.rows = copy.tables()};
  for (const auto& [key, row] : out.rows.at(map_tables::kSubmaps))
    if (const auto id = node::submap_of_key(key))
      out.free_robot.value = std::max(out.free_robot.value, id->chain.robot.value + 1);
  return out;
}

Status keep_extended(const HeldMap& before, const storage::TableStore& map, const std::filesystem::path& out) {
  const auto chains = sessions_of_known_robots(before, map);
  if (!chains) return tl::unexpected(chains.error());
  if (chains->empty()) return copy_map(map, out);
  return make_map(out, [&](storage::TableStore& to) -> Status {
    if (auto ok = renumber(map, *chains, to); !ok) return ok;
    Writer writer(to);
    for (const auto& [from, chain] : *chains) {  // its row is that of before: who owns the name lives on
      const std::string key = node::RobotRegistry::key(chain.robot);
      auto row = map.read(map_tables::kMeta, key);
      if (!row) return tl::unexpected(row.error());
      if (*row)
        if (auto ok = writer.put({map_tables::kMeta, key, std::move(**row)}); !ok) return ok;
    }
    return writer.flush();
  });
}

}  // namespace tutti::mapfile
