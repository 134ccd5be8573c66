// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::mapfile {

struct Salvaged {
  std::string kind;                         ///< "map" or "robot".
  std::map<std::string, std::size_t> rows;  ///< Number of whole rows, by table.
  std::vector<std::string> lost;            ///< A sentence for each lost row.
};

/// Copies every whole row of a damaged map into a new one. `in` stays as it is; `out` must not exist and appears whole
/// or not at all. A server that opens the new map gets the missing submaps from the robots again, as far as they still
/// have them. Errors are those of storage::DamagedStore and make_store().
Result<Salvaged> salvage(const std::filesystem::path& in, const std::filesystem::path& out, std::uint64_t now_ns);

/// The same of a robot's store: its submaps first, and what it knows of itself, but not its state. The row
/// node::robot_tables::kLost of the new store has `why`, and its newest session is not before `now_ns` (since the Unix
/// epoch).
Result<Salvaged> salvage_robot(const std::filesystem::path& in, const std::filesystem::path& out,
                               const std::string& why, std::uint64_t now_ns);

/// A robot's store with nothing but these two rows. `out` as for salvage().
Status make_robot_store(const std::filesystem::path& out, const std::string& why, std::uint64_t now_ns);

}  // namespace tutti::mapfile
