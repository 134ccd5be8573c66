// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "tutti/storage/table_store.hpp"

namespace tutti::storage {

/// Limits on what a store adds to the disk.
struct SqliteOptions {
  /// Free space on the disk below which no row is added: a full disk stops others too.
  std::uint64_t min_free_bytes = std::uint64_t{256} << 20U;
  std::uint64_t max_bytes = 0;  ///< Size above which the file does not grow; 0: as far as the disk goes.
  /// Others may read the file meanwhile (open_sqlite_reader()). Two that open it so do not see each other: who does has
  /// another lock, as of a state folder.
  bool has_readers = false;
};

/// Opens a store in one SQLite file, which is made if it is missing. While the store is open and after a crash FILE-wal
/// beside the file is part of it. Writes that commit() has accepted are on the disk and survive a power failure
/// (synchronous=FULL). The file belongs to this process alone until the store is destroyed. docs/storage.md describes
/// the file.
///
/// Errors: not an SQLite file, one of another program, another kind or a newer version, a damaged one, one that another
/// process has open. Damage within a row is found by its hash when the row is read.
Result<std::unique_ptr<TableStore>> open_sqlite_store(const std::filesystem::path& file, const Schema& schema,
                                                      const SqliteOptions& options = {});

/// Opens a store that another process may have open with SqliteOptions::has_readers, to read what that has committed;
/// commit() is an error. Each call sees the newest commit. The other process waits for no reader, but its log grows
/// while a scan goes on. Errors as above, and that there is no such file; damage elsewhere than in the rows that are
/// read is not looked for.
Result<std::unique_ptr<TableStore>> open_sqlite_reader(const std::filesystem::path& file, const Schema& schema);

}  // namespace tutti::storage
