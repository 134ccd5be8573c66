// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <set>
#include <vector>

#include "tutti/mapfile/content.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// The sessions that were added to a map until its poses were held again (hold_map()). A version has those of all
/// before it, too.
struct Version {
  std::uint64_t number = 1;
  std::int64_t held_ns = 0;  ///< When its poses were held, since the Unix epoch; 0: they may move.
  std::set<ChainId> chains;  ///< The sessions that it added.
};
/// All versions, the oldest first; a map that was never held has one. Errors: a damaged row.
Result<std::vector<Version>> versions(const storage::TableStore& map);
/// A row `version/NUMBER`, encoded as numbers of 8 bytes: when it was held, then robot and session of each chain.
storage::Write to_row(const Version& version);

/// How much a version added.
struct VersionSize {
  std::size_t submaps = 0, keyframes = 0;
  double minutes = 0.0;
  std::size_t own_closures = 0;      ///< Accepted ones between its sessions.
  std::size_t earlier_closures = 0;  ///< Accepted ones with earlier versions.
};
/// `all`: versions() of the map.
std::vector<VersionSize> sizes_of(const std::vector<Version>& all, const Content& content,
                                  const server::MapEstimate& map);

/// Makes a map's file `out`, which must not exist, of `map` as it was in a version: what later ones added is left out,
/// and poses of that version, which were held, are as they were. Returns the number of submaps that are left out.
/// Errors: there is no such version, or it is the newest.
Result<std::size_t> revert(const std::filesystem::path& map, std::uint64_t number, const std::filesystem::path& out);

}  // namespace tutti::mapfile
