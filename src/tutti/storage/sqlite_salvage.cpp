// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_salvage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "tutti/storage/internal/first_page.hpp"
#include "tutti/storage/internal/sqlite.hpp"

namespace tutti::storage {

using internal::Database, internal::Statement, internal::Use;
namespace {

namespace fs = std::filesystem;

/// No row is smaller: its key, its hash, their lengths, and the same key in the index.
constexpr std::uint64_t kLeastRow = 32;
constexpr std::string_view kTooMuch = "it claims more than a file of this size can hold";

}  // namespace

class DamagedStore::File {
 public:
  explicit File(fs::path file) : file_(std::move(file)) {}
  Status open(std::span<const Schema> schemas);
  Status read(const std::string& table, const TakeRow& take, std::vector<LostRow>& lost);
  [[nodiscard]] const Schema& schema() const { return schema_; }
  [[nodiscard]] bool is_without_first_page() const { return is_without_first_page_; }
  [[nodiscard]] const fs::path& path() const { return file_; }

 private:
  /// Pages that two places of a damaged file claim would be read again and again: nothing is read that cannot be in it.
  class Budget {
   public:
    explicit Budget(std::uint64_t file_bytes) : bytes_(2 * file_bytes), rows_(file_bytes / kLeastRow + 1) {}
    [[nodiscard]] std::uint64_t rows() const { return rows_; }
    [[nodiscard]] bool take(std::size_t bytes) {
      const bool is_there = bytes <= bytes_;
      bytes_ -= std::min<std::uint64_t>(bytes_, bytes);
      return is_there;
    }

   private:
    std::uint64_t bytes_, rows_;
  };
  /// Which rows there are, by any path into the table.
  struct Found {
    std::set<std::int64_t> rows;
    std::map<std::int64_t, std::string> keys;
    std::string damage;
  };
  Status connect();
  Status replace_first_page(const Schema& schema);
  [[nodiscard]] bool has_tables() const { return first_value("SELECT count(*) FROM sqlite_schema").has_value(); }
  [[nodiscard]] Statement prepare(const std::string& sql) const;
  [[nodiscard]] std::string message() const { return sqlite3_errmsg(database_.get()); }
  [[nodiscard]] std::optional<std::string> first_value(const std::string& sql) const;
  [[nodiscard]] bool has(const std::string& table, const std::string& sql) const;
  [[nodiscard]] bool has_table(const std::string& table) const { return has(table, internal::sql_of_table(table)); }
  Status choose_schema(std::span<const Schema> schemas);
  Found find(const std::string& table);
  /// The rows on one path, each given to `note`; the number of the last, if there is one.
  std::optional<std::int64_t> walk(const std::string& sql, const std::function<void(const Use&)>& note, Found& found);

  fs::path file_;
  Database database_;
  Schema schema_;
  Budget budget_{0};
  bool is_without_first_page_ = false;
};

/// Null: it cannot be.
Statement DamagedStore::File::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr);
  return Statement(statement);
}

std::optional<std::string> DamagedStore::File::first_value(const std::string& sql) const {
  const Statement statement = prepare(sql);
  if (!statement) return std::nullopt;
  Use use(statement);
  return use.step() == SQLITE_ROW ? std::optional(std::string(use.bytes(0))) : std::nullopt;
}

/// It is ours, and no view, nor one that computes anything.
bool DamagedStore::File::has(const std::string& table, const std::string& sql) const {
  return first_value(fmt::format(
             "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = '{}' AND sql = '{}'", table, sql)) ==
         "1";
}

Status DamagedStore::File::connect() {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(file_.c_str(), &database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (code != SQLITE_OK) return fail(ErrorCode::io, "{}: {}", file_.string(), message());
  sqlite3_exec(database, "PRAGMA trusted_schema = OFF", nullptr, nullptr, nullptr);
  return {};
}

Status DamagedStore::File::choose_schema(std::span<const Schema> schemas) {
  const bool has_kind = has("store", internal::sql_of_kind());
  const std::string kind = has_kind ? first_value("SELECT kind FROM store").value_or("") : "",
                    version = first_value("PRAGMA user_version").value_or(""),
                    application = first_value("PRAGMA application_id").value_or("");
  if (kind.empty() && application != std::to_string(internal::kApplicationId))
    return fail(ErrorCode::parse, "{}: an SQLite file of another program", file_.string());
  auto found = std::ranges::find_if(schemas, [&](const Schema& schema) {
    return kind.empty() ? has_table(schema.tables.front()) : schema.kind == kind;
  });
  if (found == schemas.end() && kind.empty()) found = schemas.begin();
  if (found == schemas.end())
    return fail(ErrorCode::invalid, "{}: holds a {}, expected a {}", file_.string(), kind, schemas.front().kind);
  schema_ = *found;
  const bool is_other = version != std::to_string(schema_.version);
  if (is_other && first_value(internal::sql_of_strange_tables(schema_)).value_or("0") != "0")
    return fail(ErrorCode::unsupported, "{}: a {} of version {}, this program reads version {}{}", file_.string(),
                schema_.kind, version, schema_.version, internal::kUpgrade);
  return {};
}

Status DamagedStore::File::replace_first_page(const Schema& schema) {
  database_.reset();
  if (Status ok = internal::replace_first_page(file_, schema); !ok) return ok;
  if (Status ok = connect(); !ok || has_tables()) return ok;
  database_.reset();  // the log has another one, no better
  std::error_code ignored;
  for (const char* end : {"-wal", "-shm"}) fs::remove(file_.string() + end, ignored);
  return connect();
}

Status DamagedStore::File::open(std::span<const Schema> schemas) {
  std::error_code failure;
  if (!fs::is_regular_file(file_, failure)) return fail(ErrorCode::io, "{}: no such file", file_.string());
  const std::uint64_t size = fs::file_size(file_, failure), log = fs::file_size(file_.string() + "-wal", failure);
  budget_ = Budget(size + (failure ? 0 : log));
  if (Status ok = internal::forget_size(file_); !ok) return ok;
  if (size > 0)  // SQLite would take an empty one for new, and delete its log
    if (Status ok = connect(); !ok) return ok;
  if (size == 0 || !has_tables()) {
    is_without_first_page_ = true;
    if (Status ok = replace_first_page(schemas.front()); !ok) return ok;
  }
  if (Status ok = choose_schema(schemas); !ok) return ok;
  if (is_without_first_page_ && schema_ != schemas.front())
    if (Status ok = replace_first_page(schema_); !ok) return ok;
  if (std::ranges::any_of(schema_.tables, [&](const std::string& table) { return has_table(table); })) return {};
  return fail(ErrorCode::parse, "{}: none of its tables can be found: {}", file_.string(), message());
}

std::optional<std::int64_t> DamagedStore::File::walk(const std::string& sql,
                                                     const std::function<void(const Use&)>& note, Found& found) {
  std::optional<std::int64_t> last;
  const Statement statement = prepare(sql);
  if (!statement) return last;
  Use use(statement);
  std::uint64_t rows = 0;
  int code = use.step();
  for (; code == SQLITE_ROW && ++rows <= budget_.rows(); code = use.step()) {
    last = use.number(0);
    found.rows.insert(*last);
    note(use);
  }
  if (code == SQLITE_ROW)
    found.damage = kTooMuch;
  else if (code != SQLITE_DONE)
    found.damage = message();
  return last;
}

/// Forwards and backwards, by the table and by the index of its keys: what one path cannot reach behind a damaged page
/// another may. Between the ends of the first two, every number may be a row's.
DamagedStore::File::Found DamagedStore::File::find(const std::string& table) {
  Found found;
  const auto nothing = [](const Use&) {};
  const auto keep_key = [&](const Use& use) {
    if (budget_.take(use.bytes(1).size())) found.keys.emplace(use.number(0), use.bytes(1));
  };
  const std::string by_number = "SELECT rowid FROM " + table + " NOT INDEXED ORDER BY rowid";
  const auto end = walk(by_number, nothing, found);
  if (!found.damage.empty()) {
    const auto begin = walk(by_number + " DESC", nothing, found);
    if (end && begin && *begin > *end)
      for (std::int64_t row = *end + 1; row < *begin && found.rows.size() < budget_.rows(); ++row)
        found.rows.insert(row);
  }
  for (const char* order : {"", " DESC"})
    walk("SELECT rowid, key FROM " + table + " INDEXED BY sqlite_autoindex_" + table + "_1 ORDER BY key" + order,
         keep_key, found);
  return found;
}

Status DamagedStore::File::read(const std::string& table, const TakeRow& take, std::vector<LostRow>& lost) {
  const Statement row = has_table(table)
                            ? prepare("SELECT key, hash, bytes FROM " + table + " NOT INDEXED WHERE rowid = ?1")
                            : Statement();
  if (!row) {
    lost.push_back({table, "", "the table cannot be found: " + message()});
    return {};
  }
  const Found found = find(table);
  std::size_t unnamed = 0;
  std::string why;
  std::set<std::string, std::less<>> taken;  // of two rows with one key, a whole table has none
  for (const std::int64_t id : found.rows) {
    const auto key = found.keys.find(id);
    const std::string known = key == found.keys.end() ? "" : key->second;
    Use use(row);
    use.bind(1, id);
    const int code = use.step();
    if (code == SQLITE_DONE && known.empty()) continue;  // a number of no row
    const std::string_view bytes = code == SQLITE_ROW ? use.bytes(2) : std::string_view();
    if (code != SQLITE_ROW || !budget_.take(bytes.size() + use.bytes(0).size())) {
      why = code == SQLITE_ROW ? std::string(kTooMuch) : "cannot be read: " + message();
      if (known.empty())
        ++unnamed;
      else
        lost.push_back({table, known, why});
    } else if (use.number(1) != internal::hash_of(use.bytes(0), bytes)) {
      lost.push_back({table, known.empty() ? std::string(use.bytes(0)) : known, "its bytes do not have its hash"});
    } else if (taken.emplace(use.bytes(0)).second) {
      if (Status ok = take(table, use.bytes(0), bytes); !ok) return ok;
    }
  }
  if (unnamed > 0) lost.push_back({table, "", fmt::format("up to {} rows of unknown keys: {}", unnamed, why)});
  if (!found.damage.empty())
    lost.push_back({table, "", "there may be more that nothing names any more: " + found.damage});
  return {};
}

DamagedStore::DamagedStore(std::unique_ptr<File> file) : file_(std::move(file)) {}
DamagedStore::DamagedStore(DamagedStore&& other) noexcept = default;
DamagedStore::~DamagedStore() = default;

Result<DamagedStore> DamagedStore::open(const fs::path& copy, std::span<const Schema> schemas) {
  auto file = std::make_unique<File>(copy);
  if (Status opened = file->open(schemas); !opened) return tl::unexpected(opened.error());
  return DamagedStore(std::move(file));
}

const Schema& DamagedStore::schema() const { return file_->schema(); }

Result<std::vector<LostRow>> DamagedStore::read(std::span<const std::string> tables, const TakeRow& take) {
  std::vector<LostRow> lost;
  if (file_->is_without_first_page())
    lost.push_back({"its first page", "", "cannot be read; it is the same in every store"});
  std::size_t rows = 0;
  const auto count = [&](std::string_view table, std::string_view key, std::string_view bytes) {
    ++rows;
    return take(table, key, bytes);
  };
  for (const std::string& table : tables)
    if (Status ok = file_->read(table, count, lost); !ok) return tl::unexpected(ok.error());
  if (rows > 0 || !file_->is_without_first_page()) return lost;
  return fail(ErrorCode::parse, "{}: not an SQLite file, and no row of a {} can be found in it", file_->path().string(),
              schema().kind);
}

Status check_rows(const TableStore& store, const Schema& schema) {
  for (const std::string& table : schema.tables)
    if (Status ok = store.scan(table, {}, [](std::string_view, std::string_view) { return true; }); !ok) return ok;
  return {};
}

}  // namespace tutti::storage
