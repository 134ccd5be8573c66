// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
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

/// A store's file, whatever of it is damaged: also one that was cut short, or whose first page is lost. The file is
/// changed, so pass a copy, with its -wal. Takes time and memory in proportion to the file, whatever is in it.
class DamagedStore {
 public:
  /// Opens a copy of a file that has one of these schemas. Errors: no SQLite file, one of another program, kind or
  /// newer version, or none of its tables can be found.
  static Result<DamagedStore> open(const std::filesystem::path& copy, std::span<const Schema> schemas);
  ~DamagedStore();
  DamagedStore(DamagedStore&& other) noexcept;
  DamagedStore& operator=(DamagedStore&&) = delete;

  /// The first schema when the file does not have its kind any more.
  [[nodiscard]] const Schema& schema() const;
  /// Hands every row of these tables of the schema, one table after the other, whose bytes have their hash to `take`.
  /// Returns the lost rows, as far as anything still names them. The first error of `take` ends it and is returned.
  /// Fails when a file without its first page has no row of them either.
  Result<std::vector<LostRow>> read(std::span<const std::string> tables, const TakeRow& take);

 private:
  class File;
  explicit DamagedStore(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

/// Reads all rows of an open store; the error of the first that is damaged.
[[nodiscard]] Status check_rows(const TableStore& store, const Schema& schema);

}  // namespace tutti::storage
