// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/memory_store.hpp"

#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/storage/internal/scanning.hpp"

namespace tutti::storage {

MemoryStore::MemoryStore(const Schema& schema, Tables content) {
  for (const std::string& table : schema.tables) tables_.try_emplace(table);
  for (auto& [table, rows] : content) {
    TUTTI_CHECK(tables_.contains(table), "no table '{}' in a store of kind '{}'", table, schema.kind);
    tables_[table] = std::move(rows);
  }
}

const MemoryStore::Rows& MemoryStore::rows_of(std::string_view table) const {
  TUTTI_CHECK(!scanning_, "a visitor calls the store that it visits");
  const auto found = tables_.find(table);
  TUTTI_CHECK(found != tables_.end(), "no table '{}'", table);
  return found->second;
}

Status MemoryStore::commit(std::span<const Write> writes) {
  const std::scoped_lock lock(mutex_);
  for (const Write& write : writes) static_cast<void>(rows_of(write.table));  // all or nothing
  for (const Write& write : writes) {
    Rows& rows = tables_[write.table];
    if (write.bytes) rows.insert_or_assign(write.key, *write.bytes);
    if (!write.bytes) rows.erase(write.key);
  }
  return {};
}

Result<std::optional<std::string>> MemoryStore::read(std::string_view table, std::string_view key) const {
  const std::scoped_lock lock(mutex_);
  const Rows& rows = rows_of(table);
  const auto found = rows.find(key);
  return found == rows.end() ? std::nullopt : std::optional(found->second);
}

Status MemoryStore::scan(std::string_view table, std::string_view from, const Visit& visit) const {
  const std::scoped_lock lock(mutex_);
  const Rows& rows = rows_of(table);
  const Scanning scanning(scanning_);
  for (auto row = rows.lower_bound(from); row != rows.end(); ++row)
    if (!visit(row->first, row->second)) break;
  return {};
}

Status MemoryStore::sizes(std::string_view table, const VisitSize& visit) const {
  const std::scoped_lock lock(mutex_);
  const Rows& rows = rows_of(table);
  const Scanning scanning(scanning_);
  for (const auto& [key, bytes] : rows) visit(key, bytes.size());
  return {};
}

MemoryStore::Tables MemoryStore::tables() const {
  const std::scoped_lock lock(mutex_);
  return tables_;
}

}  // namespace tutti::storage
