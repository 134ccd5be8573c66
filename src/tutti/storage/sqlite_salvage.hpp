// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/storage/table_store.hpp"

namespace tutti::storage {

/// A row, or an unknown number of rows, that could not be read from a damaged store.
struct LostRow {
  std::string table;
  std::string key;  ///< Empty when the key is unknown, too.
  std::string why;
};

/// Is called with each whole row; an error ends the salvage.
using TakeRow = std::function<Status(std::string_view table, std::string_view key, std::string_view bytes)>;

/// Hands every row of the schema's tables whose bytes have their hash to `take`, whatever else of the SQLite file is
/// damaged. Returns the lost rows, as far as anything still names them. The first error of `take` ends the salvage and
/// is returned. The file is changed, so pass a copy, with its -wal. Errors: no SQLite file, one of another program,
/// kind or newer version, or none of its tables can be found.
Result<std::vector<LostRow>> salvage_sqlite_store(const std::filesystem::path& copy, const Schema& schema,
                                                  const TakeRow& take);

}  // namespace tutti::storage
