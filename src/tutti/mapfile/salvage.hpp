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
  std::map<std::string, std::size_t> rows;  ///< Those of each table that are whole.
  std::vector<std::string> lost;            ///< A sentence for each of the others.
};

/// Copies every row of a damaged map that is whole into a new one, which a server takes: robots send what is missing
/// again, as far as they have it. `in` stays as it is; `out` must not be there, and appears whole or not at all.
Result<Salvaged> salvage(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace tutti::mapfile
