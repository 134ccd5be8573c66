// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include "tutti/storage/memory_store.hpp"

namespace tutti::program::test {

/// On a disk that may be full.
class FullDisk : public storage::TableStore {
 public:
  explicit FullDisk(storage::Schema schema) : rows_(std::move(schema)) {}
  Status commit(std::span<const storage::Write> writes) override {
    if (full) return fail(ErrorCode::io, "disk full");
    return rows_.commit(writes);
  }
  [[nodiscard]] Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const override {
    return rows_.read(table, key);
  }
  [[nodiscard]] Status scan(std::string_view table, std::string_view from, const Visit& visit) const override {
    return rows_.scan(table, from, visit);
  }
  [[nodiscard]] Status sizes(std::string_view table, const VisitSize& visit) const override {
    return rows_.sizes(table, visit);
  }
  bool full = false;

 private:
  storage::MemoryStore rows_;
};

}  // namespace tutti::program::test
