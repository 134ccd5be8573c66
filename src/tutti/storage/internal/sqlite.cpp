// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/internal/sqlite.hpp"

#include <fmt/format.h>

#include "tutti/base/content_hash.hpp"

namespace tutti::storage::internal {

std::string sql_of_kind() { return "CREATE TABLE store (kind TEXT NOT NULL)"; }

std::string sql_of_table(const std::string& table) {
  return "CREATE TABLE " + table + " (key BLOB PRIMARY KEY NOT NULL, hash INTEGER NOT NULL, bytes BLOB NOT NULL)";
}

std::string sql_of_store(const Schema& schema) {
  std::string sql = "BEGIN;" + sql_of_kind() + ";INSERT INTO store VALUES('" + schema.kind + "');";
  for (const std::string& table : schema.tables) sql += sql_of_table(table) + ";";
  return sql + fmt::format("PRAGMA application_id={};PRAGMA user_version={};COMMIT", kApplicationId, schema.version);
}

std::string sql_of_strange_tables(const Schema& schema) {
  std::string known = "'store'";
  for (const std::string& table : schema.tables) known += ", '" + table + "'";
  return "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name NOT IN (" + known + ")";
}

std::int64_t hash_of(std::string_view key, std::string_view bytes) {
  return static_cast<std::int64_t>(content_hash(bytes, content_hash(key)));
}

std::string hex(std::string_view key) {
  std::string text;
  for (const char c : key) text += fmt::format("{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace tutti::storage::internal
