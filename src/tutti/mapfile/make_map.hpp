// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// Makes a new store's file that `fill` writes. `out` must not exist; it appears whole or, on an error, not at all.
Status make_store(const std::filesystem::path& out, const storage::Schema& schema,
                  const std::function<Status(storage::TableStore&)>& fill);
/// Makes a new map's file in the same manner.
Status make_map(const std::filesystem::path& out, const std::function<Status(storage::TableStore&)>& fill);
/// All rows of one map's store into another, which is empty.
Status copy_rows(const storage::TableStore& from, storage::TableStore& to);
/// Makes a new map's file with all rows of another store; `out` as in make_map().
Status copy_map(const storage::TableStore& from, const std::filesystem::path& out);
/// The name that make_store() uses beside `out` until the file is whole, for programs that remove what an interrupted
/// one left.
std::filesystem::path part_of(const std::filesystem::path& out);
/// Removes a store's file and what SQLite leaves beside it; a missing file is no error.
void remove_store(const std::filesystem::path& file);

/// Commits rows in portions of 16 MB, so that a large map need not fit into memory. flush() commits the rest.
class Writer {
 public:
  explicit Writer(storage::TableStore& out) : out_(out) {}
  Status put(storage::Write write);
  Status flush();

 private:
  static constexpr std::size_t kPortion = 16U << 20U;
  storage::TableStore& out_;
  std::vector<storage::Write> writes_;
  std::size_t bytes_ = 0;
};

}  // namespace tutti::mapfile
