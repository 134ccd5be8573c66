// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "tutti/base/config.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::storage {

struct SqliteOptions {
  std::uint64_t min_free_bytes = std::uint64_t{256} << 20U;
  std::uint64_t max_bytes = 0;
  template <class V>
  void describe(V& v) {
    v.field("min_free_bytes", min_free_bytes, any(),
            "Free space on the disk below which no row is added: a full disk stops others too.");
    v.field("max_bytes", max_bytes, any(), "Size above which the file does not grow; 0 = as far as the disk goes.");
  }
};

/// A store in one SQLite file, made if it is missing; beside it, while it is open and after a crash, lies FILE-wal,
/// which is part of it. What commit() has taken is on the disk, also when the machine stops (synchronous=FULL). The
/// file is this process's alone until the store is destroyed. docs/storage.md describes the file.
///
/// Errors: not an SQLite file, another program's, of another kind or version, damaged, open elsewhere. Damage within a
/// row is found when the row is read, by its hash.
Result<std::unique_ptr<TableStore>> open_sqlite_store(const std::filesystem::path& file, const Schema& schema,
                                                      const SqliteOptions& options = {});

}  // namespace tutti::storage
