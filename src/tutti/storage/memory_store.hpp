// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "tutti/storage/table_store.hpp"

namespace tutti::storage {

/// A store in memory: its content survives the node that writes to it, but not the process.
class MemoryStore final : public TableStore {
 public:
  using Rows = std::map<std::string, std::string, std::less<>>;
  using Tables = std::map<std::string, Rows, std::less<>>;

  /// `content`: rows to begin with, as tables() returns them; their tables must be in the schema.
  explicit MemoryStore(const Schema& schema, Tables content = {});

  Status commit(std::span<const Write> writes) override;
  [[nodiscard]] Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const override;
  [[nodiscard]] Status scan(std::string_view table, std::string_view from, const Visit& visit) const override;
  [[nodiscard]] Status sizes(std::string_view table, const VisitSize& visit) const override;

  /// A copy of all rows; tables without rows are in it.
  [[nodiscard]] Tables tables() const;

 private:
  [[nodiscard]] const Rows& rows_of(std::string_view table) const;

  mutable std::recursive_mutex mutex_;  ///< Recursive, so that a visitor that calls the store gets an error.
  mutable bool scanning_ = false;
  Tables tables_;
};

}  // namespace tutti::storage
