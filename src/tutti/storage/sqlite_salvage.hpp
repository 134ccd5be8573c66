// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/storage/table_store.hpp"

namespace tutti::storage {

/// What could not be read of a damaged store.
struct LostRow {
  std::string table;
  std::string key;  ///< Empty: not known either.
  std::string why;
};

/// Hands every row of the schema's tables that is whole, by its hash, to `take`, whatever else of the SQLite file is
/// damaged; returns the others, as far as anything still names them. The first error of `take` ends it. The file is
/// changed: give it a copy, with its -wal. Errors: no SQLite file, another program's, of another kind, or not even its
/// tables can be found.
using TakeRow = std::function<Status(std::string_view table, std::string_view key, std::string_view bytes)>;
Result<std::vector<LostRow>> salvage_sqlite_store(const std::filesystem::path& copy, const Schema& schema,
                                                  const TakeRow& take);

}  // namespace tutti::storage
