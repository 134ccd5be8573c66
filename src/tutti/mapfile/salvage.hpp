// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::mapfile {

struct Salvaged {
  std::map<std::string, std::size_t> rows;  ///< Number of whole rows, by table.
  std::vector<std::string> lost;            ///< A sentence for each lost row.
};

/// Copies every whole row of a damaged map into a new one. A server that opens the new map gets the missing submaps
/// from the robots again, as far as they still have them. `in` stays as it is; `out` must not exist and appears whole
/// or not at all. Errors are those of storage::salvage_sqlite_store() and make_map().
Result<Salvaged> salvage(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace tutti::mapfile
