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

/// Copies every whole row of a damaged store into a new one. `in` stays as it is; `out` must not exist and appears
/// whole or not at all. Errors are those of storage::DamagedStore and make_store().
///
/// A server that opens the new map gets the missing submaps from the robots again, as far as they still have them. From
/// a robot's store its submaps are taken first, and what it knows of itself; its state is not, so that the robot which
/// opens the new store begins a session, later than `now_ns` (since the Unix epoch) and than all that the store knows,
/// and reports why.
Result<Salvaged> salvage(const std::filesystem::path& in, const std::filesystem::path& out, std::uint64_t now_ns);

/// The same of what must be a robot's store. `why` is what the robot will report.
Result<Salvaged> salvage_robot(const std::filesystem::path& in, const std::filesystem::path& out,
                               const std::string& why, std::uint64_t now_ns);

/// A robot's store with nothing but the reason why its robot begins a session. `out` as for salvage().
Status make_robot_store(const std::filesystem::path& out, const std::string& why, std::uint64_t now_ns);

}  // namespace tutti::mapfile
