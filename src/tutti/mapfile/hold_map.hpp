// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// Makes a map one that does not move: from now on whoever opens it keeps every pose of its largest component as it is,
/// to the bit, and lays what comes later beside them. Returns the number of keyframes that are held. A map that is held
/// already stays as it is.
Result<std::size_t> hold_map(storage::TableStore& map);

/// Makes a map's file `out`, which must not exist, of a copy of `map` that is held.
Result<std::size_t> copy_held(const std::filesystem::path& map, const std::filesystem::path& out);

/// A map that robots of a mission extend.
struct HeldMap {
  storage::MemoryStore::Tables rows;  ///< A copy of `map`, which is held.
  RobotId free_robot;                 ///< From this number on it has no robots.
};
Result<HeldMap> read_held(const std::filesystem::path& map);

}  // namespace tutti::mapfile
