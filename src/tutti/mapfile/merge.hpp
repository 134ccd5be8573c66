// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

struct Merged {
  std::size_t submaps = 0;
  std::size_t shared = 0;                 ///< Submaps that are in both maps.
  std::map<ChainId, ChainId> renumbered;  ///< Chains of the second map that have other numbers in the third.
};

/// Puts what two maps contain into an empty third: submaps, verdicts, answers and decisions with their bytes unchanged,
/// refinements as ones of parts of the joint map. The server that opens the third map looks for closures between the
/// two, and robots follow it, because its epoch is larger than both. Robots keep their numbers, so it is an error that
/// names them when one number is two robots' (by name, where both maps know it), when one name has two numbers, or when
/// a submap is in both maps with different content. Where both have a verdict on a pair: by two versions of one
/// verifier, the newer version's is taken, by the same version a refusal, otherwise the first map's. The later of two
/// decisions is taken, and the first map's settings.
Result<Merged> merge(const storage::TableStore& a, const storage::TableStore& b, storage::TableStore& out);

/// As above, with files; what would be in the way is numbered anew first (chains_to_renumber()), so that any two maps
/// can be merged; a map that is held (hold_map()) is not any more, and has one version. `out` must not exist; it
/// appears whole or not at all.
Result<Merged> merge(const std::filesystem::path& a, const std::filesystem::path& b, const std::filesystem::path& out);

}  // namespace tutti::mapfile
