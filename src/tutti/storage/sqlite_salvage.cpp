// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_salvage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "tutti/storage/internal/sqlite.hpp"

namespace tutti::storage {

using internal::Database, internal::Statement, internal::Use;
namespace {

class Salvage {
 public:
  explicit Salvage(std::filesystem::path file) : file_(std::move(file)) {}
  Status open(const Schema& schema);
  Status read(const std::string& table, const TakeRow& take, std::vector<LostRow>& lost);

 private:
  [[nodiscard]] Statement prepare(const std::string& sql) const;
  [[nodiscard]] std::string message() const { return sqlite3_errmsg(database_.get()); }
  [[nodiscard]] std::string first_value(const std::string& sql) const;

  std::filesystem::path file_;
  Database database_;
};

/// Null: it cannot be.
Statement Salvage::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr);
  return Statement(statement);
}

/// "" when there is none.
std::string Salvage::first_value(const std::string& sql) const {
  const Statement statement = prepare(sql);
  if (!statement) return "";
  Use use(statement);
  return use.step() == SQLITE_ROW ? std::string(use.bytes(0)) : "";
}

Status Salvage::open(const Schema& schema) {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(file_.c_str(), &database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (code != SQLITE_OK) return fail(ErrorCode::io, "{}: {}", file_.string(), message());
  sqlite3_exec(database, "PRAGMA trusted_schema = OFF", nullptr, nullptr, nullptr);
  const std::string application = first_value("PRAGMA application_id");
  if (application.empty()) return fail(ErrorCode::parse, "{}: {}", file_.string(), message());
  if (application != std::to_string(internal::kApplicationId))
    return fail(ErrorCode::parse, "{}: an SQLite file of another program", file_.string());
  const std::string kind = first_value("SELECT kind FROM store");
  if (!kind.empty() && kind != schema.kind)
    return fail(ErrorCode::invalid, "{}: holds a {}, expected a {}", file_.string(), kind, schema.kind);
  const std::string version = first_value("PRAGMA user_version");
  if (version.size() > 9 || std::stoul("0" + version) > schema.version)
    return fail(ErrorCode::unsupported, "{}: a {} of version {}, this program reads versions 1 to {}", file_.string(),
                schema.kind, version, schema.version);
  for (const std::string& table : schema.tables)
    if (prepare("SELECT key FROM " + table)) return {};
  return fail(ErrorCode::parse, "{}: none of its tables can be found: {}", file_.string(), message());
}

/// Rows are found forwards and backwards, by the table and by the index of its keys: what one way cannot reach behind a
/// damaged page another may.
Status Salvage::read(const std::string& table, const TakeRow& take, std::vector<LostRow>& lost) {
  std::set<std::int64_t> rows;
  std::map<std::int64_t, std::string> keys;
  std::string damage;
  for (const std::string order : {"", " DESC"}) {
    if (const Statement found = prepare("SELECT rowid FROM " + table + " NOT INDEXED ORDER BY rowid" + order)) {
      Use use(found);
      int code = use.step();
      for (; code == SQLITE_ROW; code = use.step()) rows.insert(use.number(0));
      if (code != SQLITE_DONE) damage = message();
    }
    if (const Statement found = prepare("SELECT rowid, key FROM " + table + " INDEXED BY sqlite_autoindex_" + table +
                                        "_1 ORDER BY key" + order)) {
      Use use(found);
      int code = use.step();
      for (; code == SQLITE_ROW; code = use.step()) {
        rows.insert(use.number(0));
        keys.emplace(use.number(0), use.bytes(1));
      }
      if (code != SQLITE_DONE) damage = message();
    }
  }
  const Statement row = prepare("SELECT key, hash, bytes FROM " + table + " NOT INDEXED WHERE rowid = ?1");
  if (!row) {
    lost.push_back({table, "", "the table cannot be found: " + message()});
    return {};
  }
  for (const std::int64_t id : rows) {
    const auto key = keys.find(id);
    const std::string known = key == keys.end() ? "" : key->second;
    Use use(row);
    use.bind(1, id);
    if (use.step() != SQLITE_ROW) {
      lost.push_back({table, known, "cannot be read: " + message()});
      continue;
    }
    if (use.number(1) != internal::hash_of(use.bytes(0), use.bytes(2))) {
      lost.push_back({table, known.empty() ? std::string(use.bytes(0)) : known, "its bytes do not have its hash"});
      continue;
    }
    if (Status taken = take(table, use.bytes(0), use.bytes(2)); !taken) return taken;
  }
  if (!damage.empty()) lost.push_back({table, "", "there may be more that nothing names any more: " + damage});
  return {};
}

}  // namespace

Result<std::vector<LostRow>> salvage_sqlite_store(const std::filesystem::path& copy, const Schema& schema,
                                                  const TakeRow& take) {
  Salvage salvage(copy);
  if (Status opened = salvage.open(schema); !opened) return tl::unexpected(opened.error());
  std::vector<LostRow> lost;
  for (const std::string& table : schema.tables)
    if (Status read = salvage.read(table, take, lost); !read) return tl::unexpected(read.error());
  return lost;
}

}  // namespace tutti::storage
