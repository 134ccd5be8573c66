// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

struct Merged {
  std::size_t submaps = 0;
  std::size_t shared = 0;  ///< Submaps that were in both.
};

/// Puts what two maps hold into an empty third: submaps, verdicts and words, their bytes as they came. Pairs of submaps
/// from both are candidates for the server that opens it, and robots hear what it sends: its epoch is larger than both.
/// Robots keep their numbers, so that one number must not be two robots' (by name, where both maps know it), and one
/// submap not be two; these are errors that name them. Of two verdicts on one pair the newer finder's is taken, of two
/// words the later, of settings the first map's.
Result<Merged> merge(const storage::TableStore& a, const storage::TableStore& b, storage::TableStore& out);

/// The same with files. `out` must not be there; it appears whole or not at all.
Result<Merged> merge(const std::filesystem::path& a, const std::filesystem::path& b, const std::filesystem::path& out);

}  // namespace tutti::mapfile
