// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// Makes a map one that does not move: from now on whoever opens it keeps every pose of its floors (floors.hpp) as it
/// is, to the bit, and lays what comes later beside them. Poses that are held already stay so. Those held now for the
/// first time are a version of the map (Version), of `now_ns` since the Unix epoch. Returns the number of keyframes
/// that are held.
Result<std::size_t> hold_map(storage::TableStore& map, std::int64_t now_ns);

/// Makes a map's file `out`, which must not exist, of a copy of `map` that is held.
Result<std::size_t> copy_held(const std::filesystem::path& map, const std::filesystem::path& out, std::int64_t now_ns);

/// A map that robots of a mission extend; by default a new one.
struct HeldMap {
  storage::MemoryStore::Tables rows;  ///< As storage::map_schema(); its poses are held.
  RobotId free_robot{0};              ///< From this number on it has no robots.
};
/// A copy of a map's file, which is held.
Result<HeldMap> read_held(const std::filesystem::path& map, std::int64_t now_ns);
/// Makes a map's file `out`, which must not exist, of a mission's map that began with `before`. A robot with the name
/// of one that was there is that robot, in a session after its others.
Status keep_extended(const HeldMap& before, const storage::TableStore& map, const std::filesystem::path& out);

}  // namespace tutti::mapfile
