// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "tutti/storage/table_store.hpp"

/// SQLite's handles, and what stores have in every row.
namespace tutti::storage::internal {

inline constexpr std::int64_t kApplicationId = 0x54757474;  // "Tutt", at byte 68 of the file

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, Close>;
using Statement = std::unique_ptr<sqlite3_stmt, Close>;

/// One use of a prepared statement: releases what is bound and locked when it ends.
class Use {
 public:
  explicit Use(const Statement& statement) : statement_(statement.get()) {}
  ~Use() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

  /// `bytes` outlives this.
  void bind(int index, std::string_view bytes) {
    const char* data = bytes.empty() ? "" : bytes.data();  // null would be bound as NULL
    sqlite3_bind_blob64(statement_, index, data, bytes.size(), SQLITE_STATIC);
  }
  void bind(int index, std::int64_t number) { sqlite3_bind_int64(statement_, index, number); }
  int step() { return sqlite3_step(statement_); }
  [[nodiscard]] std::string_view bytes(int column) const {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return {data == nullptr ? "" : data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }
  [[nodiscard]] std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }

 private:
  sqlite3_stmt* statement_;
};

/// The statements that make a store's tables: they are in its schema, letter by letter.
std::string sql_of_kind();
std::string sql_of_table(const std::string& table);
/// Makes all of an empty store, in one transaction.
std::string sql_of_store(const Schema& schema);

/// How many tables a file has that are not the schema's: SQL for one number. A file of another version has some.
std::string sql_of_strange_tables(const Schema& schema);

/// Ends the message of whoever refuses a file of another version.
inline constexpr std::string_view kUpgrade = ": upgrade the older of the two programs (tutti --version)";

/// FNV-1a over the key, then over the bytes. Any change within eight neighbouring bits changes it.
std::int64_t hash_of(std::string_view key, std::string_view bytes);
/// For messages: hexadecimal, as SQLite's x'..' wants it.
std::string hex(std::string_view key);

}  // namespace tutti::storage::internal
