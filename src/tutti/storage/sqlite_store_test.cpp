// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_store.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/base/random.hpp"

namespace {

thread_local int synced = 0;  ///< How often something was brought to the disk.

}  // namespace

extern "C" int fdatasync(int /*file*/) {  // instead of the C library's: no test waits for a disk
  ++synced;
  return 0;
}
extern "C" int fsync(int /*file*/) {
  ++synced;
  return 0;
}

namespace tutti::storage {
namespace {

namespace fs = std::filesystem;

const Schema kSchema{.kind = "test", .version = 2, .tables = {"apples", "pears"}};

class SqliteStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (::testing::UnitTest::GetInstance()->current_test_info()->name() + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] fs::path file() const { return folder_ / "some.tutti"; }
  [[nodiscard]] std::unique_ptr<TableStore> open(const SqliteOptions& options = {.min_free_bytes = 0}) const {
    auto store = open_sqlite_store(file(), kSchema, options);
    EXPECT_TRUE(store.has_value()) << store.error().message;
    return std::move(*store);
  }
  /// The error of opening; "" when it works.
  [[nodiscard]] std::string refusal(const Schema& schema = kSchema) const {
    const auto store = open_sqlite_store(file(), schema);
    return store ? "" : store.error().message;
  }
  void run_sql(const char* sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file().c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  fs::path folder_;
};

void expect_says(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
}

std::vector<Write> one(const std::string& key, std::string bytes) { return {{"apples", key, std::move(bytes)}}; }

TEST_F(SqliteStoreTest, OneFileWhenItIsClosed) {
  {
    const auto store = open();
    ASSERT_TRUE(store->commit(one("a", "1")));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
  EXPECT_EQ(open()->read("apples", "a").value(), "1");
}

TEST_F(SqliteStoreTest, WhatIsCommittedIsOnTheDisk) {
  const auto store = open();
  for (int i = 0; i < 5; ++i) {
    synced = 0;
    ASSERT_TRUE(store->commit(one("a", std::to_string(i))));
    EXPECT_GE(synced, 1) << i;
  }
}

TEST_F(SqliteStoreTest, WhatIsNoStoreIsRefusedAndLeftAlone) {
  const std::string text(5000, 'x');
  ASSERT_TRUE(write_file(file(), text));
  expect_says(refusal(), {"some.tutti", "not an SQLite file", "tutti map salvage"});
  EXPECT_EQ(read_file(file()).value(), text);

  ASSERT_TRUE(write_file(file(), ""));  // SQLite would begin a new one there
  expect_says(refusal(), {"some.tutti: 0 bytes", "tutti map salvage"});
  EXPECT_EQ(fs::file_size(file()), 0U);

  fs::remove(file());
  run_sql("CREATE TABLE a (b); INSERT INTO a VALUES (1)");
  const std::string other = read_file(file()).value();
  expect_says(refusal(), {"some.tutti", "another program"});
  EXPECT_EQ(read_file(file()).value(), other);

  fs::remove(file());
  fs::create_directory(file());
  expect_says(refusal(), {"some.tutti", "unable to open"});
  fs::remove(file());
  EXPECT_FALSE(open_sqlite_store(folder_ / "nowhere" / "some.tutti", kSchema).has_value());
}

TEST_F(SqliteStoreTest, OtherKindsAndVersionsAreRefused) {
  EXPECT_EQ(refusal(), "");  // made
  EXPECT_EQ(refusal(), "");
  expect_says(refusal(map_schema()), {"some.tutti", "holds a test, expected a map"});
  Schema old = kSchema;
  old.version = 1;
  old.tables = {"apples"};
  expect_says(refusal(old), {"a test of version 2, this program reads version 1", "upgrade the older"});
  Schema more = kSchema;
  more.tables.emplace_back("plums");
  expect_says(refusal(more), {"other tables"});
  run_sql("CREATE TRIGGER evil AFTER INSERT ON apples BEGIN DELETE FROM pears; END");
  expect_says(refusal(), {"other tables", "evil"});
}

/// The version is 32 bits without a hash; which tables there are says whether it can be right.
TEST_F(SqliteStoreTest, AFlippedBitOfTheVersionIsMended) {
  EXPECT_TRUE(open()->commit(one("a", "1")));
  const std::string whole = read_file(file()).value();
  constexpr std::size_t kVersionAt = 60;  // https://www.sqlite.org/fileformat2.html, 1.3.10
  for (std::size_t bit = 0; bit < 32; ++bit) {
    std::string flipped = whole;
    flipped[kVersionAt + bit / 8] = static_cast<char>(flipped[kVersionAt + bit / 8] ^ (1 << (bit % 8)));
    ASSERT_TRUE(write_file(file(), flipped));
    fs::remove(file().string() + "-wal");
    for (int start = 0; start < 2; ++start) {
      const auto store = open_sqlite_store(file(), kSchema, {.min_free_bytes = 0});
      ASSERT_TRUE(store.has_value()) << "bit " << bit << ": " << store.error().message;
      EXPECT_EQ((*store)->read("apples", "a").value(), "1");
    }
    EXPECT_EQ(read_file(file()).value().substr(kVersionAt, 4), whole.substr(kVersionAt, 4)) << bit;
  }
}

/// A file of another version is refused as it is, whichever of the two is newer.
TEST_F(SqliteStoreTest, AFileOfAnotherVersionIsLeftAlone) {
  Schema before = kSchema;
  before.version = 1;
  before.tables = {"apples", "quinces"};
  EXPECT_TRUE(open_sqlite_store(file(), before, {.min_free_bytes = 0}).value()->commit(one("a", "1")));
  expect_says(refusal(), {"a test of version 1, this program reads version 2", "upgrade the older"});
  EXPECT_EQ(open_sqlite_store(file(), before, {.min_free_bytes = 0}).value()->read("apples", "a").value(), "1");
}

TEST_F(SqliteStoreTest, IsOpenOnce) {
  const auto store = open();
  expect_says(refusal(), {"some.tutti", "open in another program"});
  EXPECT_TRUE(store->commit(one("a", "1")));
}

TEST_F(SqliteStoreTest, AReaderSeesTheNewestCommitAndHoldsUpNobody) {
  const auto store = open({.min_free_bytes = 0, .has_readers = true});
  ASSERT_TRUE(store->commit(one("a", "1")));
  const auto reader = open_sqlite_reader(file(), kSchema);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ((*reader)->read("apples", "a").value(), "1");
  ASSERT_TRUE(store->commit(one("b", "2")));
  int seen = 0;
  ASSERT_TRUE((*reader)->scan("apples", "", [&](std::string_view, std::string_view) {
    EXPECT_TRUE(store->commit(one("c" + std::to_string(++seen), "3")));  // while the reader is at it
    return true;
  }));
  EXPECT_EQ(seen, 2);  // what was committed when it began
  EXPECT_EQ((*reader)->read("apples", "c2").value(), "3");
  expect_says((*reader)->commit(one("a", "4")).error().message, {"some.tutti", "read alone"});
  expect_says(refusal(), {"open in another program"});  // for who would have it alone
}

TEST_F(SqliteStoreTest, AStoreIsOpenedAgainWhileAReaderStays) {
  ASSERT_TRUE(open({.min_free_bytes = 0, .has_readers = true})->commit(one("a", "1")));
  const auto reader = open_sqlite_reader(file(), kSchema).value();
  ASSERT_TRUE(open({.min_free_bytes = 0, .has_readers = true})->commit(one("a", "2")));
  EXPECT_EQ(reader->read("apples", "a").value(), "2");
  EXPECT_EQ(open_sqlite_reader(folder_ / "none", kSchema).error().message,
            (folder_ / "none").string() + ": no such file, expected a test");
}

TEST_F(SqliteStoreTest, ADamagedRowIsNamedAndTheOthersAreRead) {
  const std::string bytes = "twelve score of apples";
  ASSERT_TRUE(open()->commit(std::vector<Write>{{"apples", "a", "1"}, {"apples", "\x01k", bytes}}));
  std::string content = read_file(file()).value();
  const std::size_t at = content.find(bytes);
  ASSERT_NE(at, std::string::npos);
  content[at + 7] ^= 0x10;
  ASSERT_TRUE(write_file(file(), content));
  const auto store = open();
  EXPECT_EQ(store->read("apples", "a").value(), "1");
  const auto damaged = store->read("apples", "\x01k");
  ASSERT_FALSE(damaged.has_value());
  expect_says(damaged.error().message, {"some.tutti", "apples", "x'016b'", "damaged", "tutti map salvage"});
  const Status scanned = store->scan("apples", "", [](auto, auto) { return true; });
  ASSERT_FALSE(scanned.has_value());
  expect_says(scanned.error().message, {"x'016b'"});
  ASSERT_TRUE(store->commit(one("\x01k", bytes)));  // it came again
  EXPECT_EQ(store->read("apples", "\x01k").value(), bytes);
}

TEST_F(SqliteStoreTest, AFlippedBitAnywhereIsAnErrorOrChangesNothing) {
  std::map<std::string, std::string> rows;
  Rng rng(1);
  {
    const auto store = open();
    for (int i = 0; i < 40; ++i) {
      std::string& bytes = rows[key_of({1, static_cast<std::uint64_t>(i)})];
      for (std::uint64_t n = rng.index(i % 10 == 0 ? 9000 : 300); n > 0; --n)
        bytes.push_back(static_cast<char>(rng.index(256)));
      ASSERT_TRUE(store->commit(one(key_of({1, static_cast<std::uint64_t>(i)}), bytes)));
    }
  }
  const std::string whole = read_file(file()).value();
  constexpr std::uint64_t kPageBytes = 4096;
  int found = 0;
  int nothing = 0;
  for (int i = 0; i < 240; ++i) {
    std::string flipped = whole;
    const std::uint64_t page = rng.index(whole.size() / kPageBytes) * kPageBytes;
    const std::uint64_t within = rng.index(i % 2 == 0 ? 64 : kPageBytes);  // pages begin with what they contain where
    const std::uint64_t bit = 8 * (i % 10 == 0 ? rng.index(100) : page + within) + rng.index(8);
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    ASSERT_TRUE(write_file(file(), flipped));
    fs::remove(file().string() + "-wal");
    const auto store = open_sqlite_store(file(), kSchema, {.min_free_bytes = 0});
    std::map<std::string, std::string> read;
    const auto keep = [&](std::string_view key, std::string_view bytes) { return read.emplace(key, bytes).second; };
    if (!store || !(*store)->scan("apples", "", keep)) {
      ++found;
      continue;
    }
    EXPECT_EQ(read, rows) << "bit " << bit;
    ++nothing;
  }
  EXPECT_GT(found, 60);
  EXPECT_GT(nothing, 10);  // unused bytes, or not worth a test
}

TEST_F(SqliteStoreTest, AFullFileRefusesTheCommitAndStaysAsItWas) {
  const auto store = open({.min_free_bytes = 0, .max_bytes = 400'000});
  ASSERT_TRUE(store->commit(one("a", "1")));
  ASSERT_TRUE(store->commit(one("big", std::string(200'000, 'x'))));
  for (int again = 0; again < 3; ++again) {
    const Status full = store->commit(std::vector<Write>{
        {"pears", "a", "1"}, {"apples", "a", std::nullopt}, {"apples", "b", std::string(300'000, 'y')}});
    ASSERT_FALSE(full.has_value());
    expect_says(full.error().message, {"some.tutti", "full"});
    EXPECT_EQ(store->read("apples", "a").value(), "1");
    EXPECT_EQ(store->read("pears", "a").value(), std::nullopt);
    EXPECT_EQ(store->read("apples", "b").value(), std::nullopt);
  }
  ASSERT_TRUE(store->commit(one("a", "2")));  // there is room for this
  ASSERT_TRUE(store->commit(std::vector<Write>{{"apples", "big", std::nullopt}}));
  EXPECT_TRUE(store->commit(one("b", std::string(300'000, 'y'))));
}

TEST_F(SqliteStoreTest, BelowTheFreeSpaceLimitOnlyWhatFitsWhereRowsWereDeletedIsTaken) {
  ASSERT_TRUE(open()->commit(one("big", std::string(200'000, 'x'))));
  const auto store = open({.min_free_bytes = std::uint64_t{1} << 62U});
  const Status full = store->commit(one("a", std::string(1000, 'y')));
  ASSERT_FALSE(full.has_value());
  expect_says(full.error().message, {"some.tutti", "free"});
  ASSERT_TRUE(store->commit(std::vector<Write>{{"apples", "big", std::nullopt}}));
  const auto before = fs::file_size(file());
  ASSERT_TRUE(store->commit(one("a", std::string(90'000, 'y'))));
  EXPECT_FALSE(store->commit(one("b", std::string(190'000, 'y'))));
  EXPECT_EQ(store->read("apples", "a").value()->size(), 90'000U);
  EXPECT_LE(fs::file_size(file()), before);
}

TEST_F(SqliteStoreTest, ARowThatIsTooLongIsRefused) {
  const auto store = open();
  const Status done = store->commit(one("a", std::string(std::size_t{256} << 20U, 'x')));
  ASSERT_FALSE(done.has_value());
  expect_says(done.error().message, {"268435457 bytes"});
}

}  // namespace
}  // namespace tutti::storage
