// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/storage/internal/scanning.hpp"
#include "tutti/storage/internal/sqlite.hpp"

namespace tutti::storage {

using internal::kApplicationId, internal::Database, internal::Statement, internal::Use, internal::hash_of,
    internal::hex, internal::sql_of_kind, internal::sql_of_store, internal::sql_of_table;
namespace {

constexpr std::size_t kLongestRow = std::size_t{256} << 20U;  // key and bytes; SQLite's own limit is 1e9

struct TableStatements {
  Statement put;
  Statement remove;
  Statement read;
  Statement scan;
  Statement sizes;
};

/// Ends the message of whoever refuses a damaged file.
constexpr std::string_view kSalvage = "; 'tutti map salvage FILE -o NEW' copies the rows that are whole";

class SqliteStore final : public TableStore {
 public:
  SqliteStore(std::filesystem::path file, const SqliteOptions& options)
      : file_(std::filesystem::absolute(file)), options_(options) {}
  Status open(const Schema& schema);
  Status open_to_read(const Schema& schema);

  Status commit(std::span<const Write> writes) override;
  [[nodiscard]] Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const override;
  [[nodiscard]] Status scan(std::string_view table, std::string_view from, const Visit& visit) const override;
  [[nodiscard]] Status sizes(std::string_view table, const VisitSize& visit) const override;

 private:
  [[nodiscard]] tl::unexpected<Error> failure(int code, std::string_view doing) const;
  [[nodiscard]] Status run(const std::string& sql) const;
  [[nodiscard]] Result<Statement> prepare(const std::string& sql) const;
  [[nodiscard]] Result<std::string> value_of(const std::string& sql) const;
  [[nodiscard]] Result<std::int64_t> number_of(const std::string& sql) const;
  Status open_file(int flags);
  Status configure();
  Status create(const Schema& schema);
  Status check_kind(const Schema& schema) const;
  Status write_version(const Schema& schema) const;
  Status check_tables(const Schema& schema) const;
  Status check_pages() const;
  Status prepare_statements(const Schema& schema);
  [[nodiscard]] Status room_for(std::span<const Write> writes) const;
  [[nodiscard]] Status write_all(std::span<const Write> writes) const;
  [[nodiscard]] Status check_row(std::string_view table, std::string_view key, std::int64_t hash,
                                 std::string_view bytes) const;
  [[nodiscard]] const TableStatements& statements(std::string_view table) const;

  std::filesystem::path file_;
  SqliteOptions options_;
  mutable std::recursive_mutex mutex_;  ///< Recursive, so that a visitor that calls the store gets an error.
  mutable bool scanning_ = false;
  bool is_reader_ = false;
  Database database_;
  std::map<std::string, TableStatements, std::less<>> tables_;
};

tl::unexpected<Error> SqliteStore::failure(int code, std::string_view doing) const {
  const std::string file = file_.string();
  switch (code & 0xff) {  // the rest details the same
    case SQLITE_BUSY:
      return fail(ErrorCode::io, "{}: is open in another program", file);
    case SQLITE_NOTADB:
      return fail(ErrorCode::parse, "{}: not an SQLite file, or its first page is damaged{}", file, kSalvage);
    case SQLITE_FULL:
      return fail(ErrorCode::io, "{}: {}: the disk, or the size that the file may have, is full", file, doing);
    case SQLITE_CORRUPT:
      return fail(ErrorCode::parse, "{}: the file is damaged: {}{}", file, sqlite3_errmsg(database_.get()), kSalvage);
    default:
      return fail(ErrorCode::io, "{}: {}: {}", file, doing, sqlite3_errmsg(database_.get()));
  }
}

Status SqliteStore::run(const std::string& sql) const {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return failure(code, sql);
  return {};
}

Result<Statement> SqliteStore::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(database_.get(), sql.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  if (code != SQLITE_OK) return failure(code, sql);
  return Statement(statement);
}

/// The first column of all rows, a line each.
Result<std::string> SqliteStore::value_of(const std::string& sql) const {
  const Result<Statement> statement = prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  Use use(*statement);
  std::string value;
  int code = use.step();
  for (; code == SQLITE_ROW; code = use.step()) {
    if (!value.empty()) value += '\n';
    value += use.bytes(0);
  }
  if (code != SQLITE_DONE) return failure(code, sql);
  return value;
}

Result<std::int64_t> SqliteStore::number_of(const std::string& sql) const {
  const Result<Statement> statement = prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  Use use(*statement);
  if (const int code = use.step(); code != SQLITE_ROW) return failure(code, sql);
  return use.number(0);
}

constexpr int kOthersDone_ms = 5000;  // a reader that finds a log of a killed program puts it in order first

/// Alone with the file from here on, unless there are to be readers: in exclusive mode what is locked once is kept.
Status SqliteStore::configure() {
  if (const Status opened = open_file(SQLITE_OPEN_READWRITE); !opened) return opened;
  if (sqlite3_db_readonly(database_.get(), "main") != 0)
    return fail(ErrorCode::io, "{}: cannot be written", file_.string());
  // A map comes from anywhere: nothing in it is run.
  if (options_.has_readers) sqlite3_busy_timeout(database_.get(), kOthersDone_ms);
  const char* const locks = options_.has_readers ? "PRAGMA locking_mode = NORMAL" : "PRAGMA locking_mode = EXCLUSIVE";
  // A log that one large commit has made does not stay as large.
  for (const char* sql : {locks, "PRAGMA journal_size_limit = 16777216", "PRAGMA trusted_schema = OFF",
                          "PRAGMA secure_delete = OFF", "PRAGMA synchronous = FULL", "BEGIN EXCLUSIVE", "COMMIT"})
    if (const Status done = run(sql); !done) return done;
  return {};
}

/// Beside its place, and whole when it gets its name: whoever is killed here leaves no store that is none.
Status SqliteStore::create(const Schema& schema) {
  const std::filesystem::path named = file_;
  file_ += ".new";
  std::error_code ignored;
  for (const char* end : {"", "-journal"}) std::filesystem::remove(file_.string() + end, ignored);
  Status made = open_file(SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (made) made = run(sql_of_store(schema));
  database_.reset();
  const std::filesystem::path part = std::exchange(file_, named);
  if (!made) return made;
  std::error_code failure;
  std::filesystem::rename(part, named, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be made: {}", named.string(), failure.message());
  if (const int folder = ::open(named.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); folder >= 0) {
    ::fsync(folder);  // the name, too, is on the disk
    ::close(folder);
  }
  return {};
}

Status SqliteStore::open_file(int flags) {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(file_.c_str(), &database, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (code != SQLITE_OK) return failure(code, "opening it");
  return {};
}

Status SqliteStore::check_kind(const Schema& schema) const {
  const std::string file = file_.string();
  const Result<std::int64_t> application = number_of("PRAGMA application_id");
  if (!application) return tl::unexpected(application.error());
  if (*application != kApplicationId)
    return fail(ErrorCode::parse, "{}: an SQLite file of another program (application {:#x}, Tutti's is {:#x})", file,
                *application, kApplicationId);
  const Result<std::string> kind = value_of("SELECT kind FROM store");
  if (!kind) return tl::unexpected(kind.error());
  if (*kind != schema.kind) return fail(ErrorCode::invalid, "{}: holds a {}, expected a {}", file, *kind, schema.kind);
  const Result<std::int64_t> version = number_of("PRAGMA user_version");
  if (!version) return tl::unexpected(version.error());
  if (*version == schema.version) return {};
  const Result<std::int64_t> strange = number_of(internal::sql_of_strange_tables(schema));
  if (!strange) return tl::unexpected(strange.error());
  if (*strange == 0) return {};  // a bit of the version is wrong: write_version() writes it anew
  return fail(ErrorCode::unsupported, "{}: a {} of version {}, this program reads version {}{}", file, schema.kind,
              *version, schema.version, internal::kUpgrade);
}

/// The file has the tables of this version.
Status SqliteStore::write_version(const Schema& schema) const {
  const Result<std::int64_t> version = number_of("PRAGMA user_version");
  if (!version) return tl::unexpected(version.error());
  return *version == schema.version ? Status() : run(fmt::format("PRAGMA user_version={}", schema.version));
}

Status SqliteStore::check_tables(const Schema& schema) const {
  std::vector<std::string> expected{sql_of_kind()};
  for (const std::string& table : schema.tables) expected.push_back(sql_of_table(table));
  std::ranges::sort(expected);
  const Result<std::string> found = value_of("SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY sql");
  if (!found) return tl::unexpected(found.error());
  if (*found != fmt::format("{}", fmt::join(expected, "\n")))
    return fail(ErrorCode::parse, "{}: has other tables than a {} of version {}:\n{}", file_.string(), schema.kind,
                schema.version, *found);
  return {};
}

Status SqliteStore::check_pages() const {
  const Result<std::string> damage = value_of("PRAGMA integrity_check(1)");
  if (!damage) return tl::unexpected(damage.error());
  if (*damage != "ok")  // "*** in database main ***", and in the last line what it is
    return fail(ErrorCode::parse, "{}: the file is damaged: {}{}", file_.string(),
                damage->substr(damage->rfind('\n') + 1), kSalvage);
  return {};
}

Status SqliteStore::open(const Schema& schema) {
  std::error_code failed;
  if (!std::filesystem::exists(file_, failed)) {
    if (const Status done = create(schema); !done) return done;
  } else if (std::filesystem::is_regular_file(file_, failed) && std::filesystem::file_size(file_, failed) == 0) {
    // SQLite would take it for a new one, and its log for nobody's.
    return fail(ErrorCode::parse, "{}: 0 bytes, expected a {}, or no file for a new one{}", file_.string(), schema.kind,
                kSalvage);
  }
  if (const Status done = configure(); !done) return done;
  if (const Status done = check_kind(schema); !done) return done;
  if (const Status done = check_tables(schema); !done) return done;
  if (const Status done = write_version(schema); !done) return done;
  if (const Status done = check_pages(); !done) return done;
  if (const Result<std::string> mode = value_of("PRAGMA journal_mode = WAL"); !mode)
    return tl::unexpected(mode.error());
  else if (*mode != "wal")
    return fail(ErrorCode::io, "{}: no write-ahead log on this file system, only '{}'", file_.string(), *mode);
  if (options_.max_bytes > 0) {
    const Result<std::int64_t> page = number_of("PRAGMA page_size");
    if (!page) return tl::unexpected(page.error());
    const std::uint64_t pages = std::max<std::uint64_t>(1, options_.max_bytes / static_cast<std::uint64_t>(*page));
    if (const Status done = run(fmt::format("PRAGMA max_page_count = {}", pages)); !done) return done;
  }
  return prepare_statements(schema);
}

Status SqliteStore::open_to_read(const Schema& schema) {
  is_reader_ = true;
  if (const Status opened = open_file(SQLITE_OPEN_READONLY); !opened) return opened;
  sqlite3_busy_timeout(database_.get(), kOthersDone_ms);
  if (const Status done = run("PRAGMA trusted_schema = OFF"); !done) return done;
  if (const Status done = check_kind(schema); !done) return done;
  if (const Status done = check_tables(schema); !done) return done;
  return prepare_statements(schema);
}

Status SqliteStore::prepare_statements(const Schema& schema) {
  for (const std::string& table : schema.tables) {
    TableStatements& made = tables_[table];
    std::vector<std::pair<Statement*, std::string>> all{
        {&made.read, "SELECT hash, bytes FROM " + table + " WHERE key = ?1"},
        {&made.scan, "SELECT key, hash, bytes FROM " + table + " WHERE key >= ?1 ORDER BY key"},
        {&made.sizes, "SELECT key, length(bytes) FROM " + table + " ORDER BY key"}};
    if (!is_reader_) {
      all.emplace_back(&made.put, "INSERT INTO " + table + " (key, hash, bytes) VALUES (?1, ?2, ?3) " +
                                      "ON CONFLICT (key) DO UPDATE SET hash = excluded.hash, bytes = excluded.bytes");
      all.emplace_back(&made.remove, "DELETE FROM " + table + " WHERE key = ?1");
    }
    for (const auto& [statement, sql] : all) {
      auto prepared = prepare(sql);
      if (!prepared) return tl::unexpected(prepared.error());
      *statement = std::move(*prepared);
    }
  }
  return {};
}

const TableStatements& SqliteStore::statements(std::string_view table) const {
  TUTTI_CHECK(!scanning_, "a visitor calls the store that it visits");
  const auto found = tables_.find(table);
  TUTTI_CHECK(found != tables_.end(), "no table '{}'", table);
  return found->second;
}

/// Below the limit rows may be deleted, and added in the place of deleted ones.
Status SqliteStore::room_for(std::span<const Write> writes) const {
  std::uint64_t added = 0;
  for (const Write& write : writes) added += write.bytes ? write.key.size() + write.bytes->size() : 0;
  if (added == 0) return {};
  struct statvfs disk {};
  if (statvfs(file_.parent_path().c_str(), &disk) != 0) return {};  // not a reason to lose anything
  const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize;
  if (free >= options_.min_free_bytes + added) return {};
  const Result<std::int64_t> reusable =
      number_of("SELECT freelist_count * page_size FROM pragma_freelist_count, pragma_page_size");
  if (!reusable) return tl::unexpected(reusable.error());
  if (static_cast<std::uint64_t>(*reusable) >= 2 * added) return {};  // rows fill pages at least by half
  return fail(ErrorCode::io, "{}: {} bytes are not stored: {} bytes are free on the disk, {} are to stay free",
              file_.string(), added, free, options_.min_free_bytes);
}

Status SqliteStore::write_all(std::span<const Write> writes) const {
  for (const Write& write : writes) {
    const TableStatements& of_table = statements(write.table);
    Use use(write.bytes ? of_table.put : of_table.remove);
    use.bind(1, write.key);
    if (write.bytes) {
      use.bind(2, hash_of(write.key, *write.bytes));
      use.bind(3, *write.bytes);
    }
    if (const int code = use.step(); code != SQLITE_DONE)
      return failure(code, fmt::format("{}, key x'{}'", write.table, hex(write.key)));
  }
  return run("COMMIT");
}

Status SqliteStore::commit(std::span<const Write> writes) {
  if (is_reader_) return fail(ErrorCode::io, "{}: is open to be read alone", file_.string());
  const std::scoped_lock lock(mutex_);
  for (const Write& write : writes) {
    static_cast<void>(statements(write.table));
    const std::size_t size = write.key.size() + (write.bytes ? write.bytes->size() : 0);
    if (size > kLongestRow)
      return fail(ErrorCode::invalid, "{}: {}: a row of {} bytes, at most {} are stored", file_.string(), write.table,
                  size, kLongestRow);
  }
  if (writes.empty()) return {};
  if (const Status room = room_for(writes); !room) return room;
  if (const Status begun = run("BEGIN IMMEDIATE"); !begun) return begun;
  Status done = write_all(writes);
  if (sqlite3_get_autocommit(database_.get()) == 0) static_cast<void>(run("ROLLBACK"));
  return done;
}

Status SqliteStore::check_row(std::string_view table, std::string_view key, std::int64_t hash,
                              std::string_view bytes) const {
  if (hash == hash_of(key, bytes)) return {};
  return fail(ErrorCode::parse, "{}: {}, key x'{}': the row is damaged: its {} bytes do not have its hash{}",
              file_.string(), table, hex(key), bytes.size(), kSalvage);
}

Result<std::optional<std::string>> SqliteStore::read(std::string_view table, std::string_view key) const {
  const std::scoped_lock lock(mutex_);
  Use use(statements(table).read);
  use.bind(1, key);
  const int code = use.step();
  if (code == SQLITE_DONE) return std::nullopt;
  if (code != SQLITE_ROW) return failure(code, fmt::format("{}, key x'{}'", table, hex(key)));
  const std::string_view bytes = use.bytes(1);
  if (const Status whole = check_row(table, key, use.number(0), bytes); !whole) return tl::unexpected(whole.error());
  return std::string(bytes);
}

Status SqliteStore::scan(std::string_view table, std::string_view from, const Visit& visit) const {
  const std::scoped_lock lock(mutex_);
  Use use(statements(table).scan);
  const Scanning scanning(scanning_);
  use.bind(1, from);
  std::string last(from);
  int code = use.step();
  for (; code == SQLITE_ROW; code = use.step()) {
    const std::string_view key = use.bytes(0);
    const std::string_view bytes = use.bytes(2);
    if (const Status whole = check_row(table, key, use.number(1), bytes); !whole) return whole;
    if (!visit(key, bytes)) return {};
    last = key;
  }
  if (code != SQLITE_DONE) return failure(code, fmt::format("{}, from key x'{}' on", table, hex(last)));
  return {};
}

Status SqliteStore::sizes(std::string_view table, const VisitSize& visit) const {
  const std::scoped_lock lock(mutex_);
  Use use(statements(table).sizes);
  const Scanning scanning(scanning_);
  int code = use.step();
  for (; code == SQLITE_ROW; code = use.step()) visit(use.bytes(0), static_cast<std::size_t>(use.number(1)));
  if (code != SQLITE_DONE) return failure(code, fmt::format("{}, its rows' sizes", table));
  return {};
}

}  // namespace

Result<std::unique_ptr<TableStore>> open_sqlite_store(const std::filesystem::path& file, const Schema& schema,
                                                      const SqliteOptions& options) {
  auto store = std::make_unique<SqliteStore>(file, options);
  if (const Status opened = store->open(schema); !opened) return tl::unexpected(opened.error());
  return store;
}

Result<std::unique_ptr<TableStore>> open_sqlite_reader(const std::filesystem::path& file, const Schema& schema) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed))
    return fail(ErrorCode::io, "{}: no such file, expected a {}", file.string(), schema.kind);
  auto store = std::make_unique<SqliteStore>(file, SqliteOptions());
  if (const Status opened = store->open_to_read(schema); !opened) return tl::unexpected(opened.error());
  return store;
}

}  // namespace tutti::storage
