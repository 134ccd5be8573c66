// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_salvage.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/random.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::storage {
namespace sqlite_salvage_test {

namespace fs = std::filesystem;

constexpr std::size_t kPageBytes = 4096;
const Schema kSchema{.kind = "test", .version = 2, .tables = {"apples", "pears"}};
using Rows = std::map<std::pair<std::string, std::string>, std::string>;

/// Two hundred rows in each of two tables, some of several pages.
class SqliteSalvage : public testing::Test {
 protected:
  SqliteSalvage() {
    fs::create_directories(folder_);
    Rng rng(1);
    std::vector<Write> writes;
    for (const char* table : {"apples", "pears"})
      for (std::uint64_t i = 0; i < 200; ++i) {
        std::string bytes;
        for (std::uint64_t n = rng.index(i % 10 == 0 ? 20'000 : 300); n > 0; --n)
          bytes.push_back(static_cast<char>(rng.index(256)));
        rows_[{table, key_of({7, i})}] = bytes;
        writes.push_back({table, key_of({7, i}), bytes});
      }
    EXPECT_TRUE(open_sqlite_store(file(), kSchema, {.min_free_bytes = 0}).value()->commit(writes));
    whole_ = read_file(file().string()).value();
  }
  ~SqliteSalvage() override { fs::remove_all(folder_); }
  [[nodiscard]] fs::path file() const { return folder_ / "some.tutti"; }
  void write(const std::string& bytes) const {
    ASSERT_TRUE(write_file(file().string(), bytes));
    for (const char* end : {"-wal", "-shm", "-journal"}) fs::remove(file().string() + end);
  }
  [[nodiscard]] Result<std::vector<LostRow>> salvage(const Schema& schema = kSchema) {
    taken_.clear();
    auto store = DamagedStore::open(file(), {&schema, 1});
    if (!store) return tl::unexpected(store.error());
    return store->read(schema.tables, [&](std::string_view table, std::string_view key, std::string_view b) {
      EXPECT_TRUE(taken_.emplace(std::pair(table, key), b).second);
      return Status();
    });
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("salvage_" + std::to_string(getpid()));
  Rows rows_, taken_;
  std::string whole_;
};

TEST_F(SqliteSalvage, OfAWholeFileIsEverything) {
  const auto lost = salvage();
  ASSERT_TRUE(lost.has_value()) << lost.error().message;
  EXPECT_TRUE(lost->empty());
  EXPECT_EQ(taken_, rows_);
}

TEST_F(SqliteSalvage, OneDamagedRowIsNamedAndTheOthersAreThere) {
  const auto& [name, bytes] = *std::next(rows_.begin(), 10);
  const std::size_t at = whole_.find(bytes.substr(0, 100));
  ASSERT_NE(at, std::string::npos);
  whole_[at + 5] ^= 0x10;
  ASSERT_TRUE(write_file(file().string(), whole_));
  const auto lost = salvage().value();
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(std::pair(lost[0].table, lost[0].key), name);
  EXPECT_NE(lost[0].why.find("hash"), std::string::npos) << lost[0].why;
  EXPECT_EQ(taken_.size(), rows_.size() - 1);
}

/// Every page, one at a time, as garbage: what is taken is right, and one page costs at most a table; the first and the
/// second, which describe the tables and the store, cost nothing.
TEST_F(SqliteSalvage, APageOfGarbageCostsWhatWasOnIt) {
  Rng rng(2);
  std::size_t fewest = rows_.size();
  const std::size_t pages = whole_.size() / kPageBytes;
  for (std::size_t page = 0; page < pages; page += page < 8 ? 1 : pages / 60) {
    std::string damaged = whole_;
    for (std::size_t i = 0; i < kPageBytes; ++i) damaged[page * kPageBytes + i] = static_cast<char>(rng.index(256));
    write(damaged);
    const auto lost = salvage();
    ASSERT_TRUE(lost.has_value()) << "page " << page << ": " << lost.error().message;
    for (const auto& [name, bytes] : taken_) EXPECT_EQ(rows_.at(name), bytes);
    EXPECT_TRUE(taken_.size() == rows_.size() || !lost->empty());
    EXPECT_GE(taken_.size(), page < 2 ? rows_.size() : rows_.size() / 2) << "page " << page;
    fewest = std::min(fewest, taken_.size());
  }
  RecordProperty("fewest_rows", static_cast<int>(fewest));
  EXPECT_LT(fewest, rows_.size());
}

/// Two tenths of the rows are behind the cut.
TEST_F(SqliteSalvage, AFileThatWasCutShortGivesWhatIsBeforeTheCut) {
  for (const double share : {0.99, 0.9, 0.5}) {
    const auto bytes = static_cast<std::size_t>(share * static_cast<double>(whole_.size()));
    write(whole_.substr(0, bytes));
    const auto lost = salvage();
    ASSERT_TRUE(lost.has_value()) << lost.error().message;
    EXPECT_FALSE(lost->empty());
    for (const auto& [name, b] : taken_) EXPECT_EQ(rows_.at(name), b);
    EXPECT_GT(taken_.size(), (share - 0.1) * static_cast<double>(rows_.size())) << share;
  }
}

/// Behind several damaged pages, too: no path through the table reaches what is between them.
TEST_F(SqliteSalvage, SeveralPagesCostWhatWasOnThem) {
  std::string damaged = whole_;
  const std::size_t pages = whole_.size() / kPageBytes;
  for (const std::size_t page : {pages / 4, pages / 2, 3 * pages / 4})
    damaged.replace(page * kPageBytes, kPageBytes, kPageBytes, '\x7f');
  write(damaged);
  ASSERT_TRUE(salvage().has_value());
  EXPECT_GT(taken_.size(), rows_.size() - 60);
}

/// As after a crash, when only the log was brought to the disk.
TEST_F(SqliteSalvage, TheLogOfAnEmptyFileIsRead) {
  const fs::path copy = folder_ / "copy";
  fs::remove(file());
  {
    std::vector<Write> writes;
    for (const auto& [name, bytes] : rows_) writes.push_back({name.first, name.second, bytes});
    const auto store = open_sqlite_store(file(), kSchema, {.min_free_bytes = 0}).value();
    ASSERT_TRUE(store->commit(writes));
    fs::copy_file(file().string() + "-wal", copy);
  }
  write("");
  fs::rename(copy, file().string() + "-wal");
  EXPECT_FALSE(open_sqlite_store(file(), kSchema).has_value());
  const auto lost = salvage();
  ASSERT_TRUE(lost.has_value()) << lost.error().message;
  EXPECT_EQ(taken_, rows_);
}

/// Pages that many others claim, as no program writes them: time and memory are those of the file. "apples" begins at
/// page 3, whose 400 children are one page, as are the 400 of that, ten times.
TEST_F(SqliteSalvage, ATreeWhosePagesAreSharedEnds) {
  constexpr std::uint32_t kChildren = 400, kLevels = 10, kFirst = 3, kSecond = 8;
  const auto put = [&](std::size_t at, std::uint32_t number, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) whole_[at + i] = static_cast<char>(number >> (8 * (bytes - 1 - i)) & 0xffU);
  };
  whole_.resize(20 * kPageBytes);
  for (std::uint32_t level = 0; level < kLevels; ++level) {  // file format 1.6: an inner page of a table
    const std::size_t page = ((level == 0 ? kFirst : kSecond + level - 1) - 1) * kPageBytes;
    const std::uint32_t child = kSecond + level, cells = kChildren - 1;
    put(page, 5, 1), put(page + 1, 0, 2), put(page + 3, cells, 2);
    put(page + 5, kPageBytes - 5 * cells, 2), put(page + 7, 0, 1), put(page + 8, child, 4);
    for (std::uint32_t cell = 0; cell < cells; ++cell) {
      const std::uint32_t at = kPageBytes - 5 * (cell + 1);
      put(page + 12 + 2 * cell, at, 2), put(page + at, child, 4), put(page + at + 4, 1, 1);
    }
  }
  write(whole_);
  const auto lost = salvage();
  ASSERT_TRUE(lost.has_value()) << lost.error().message;
  EXPECT_FALSE(lost->empty());
}

TEST_F(SqliteSalvage, AFlippedBitOfTheVersionLosesNothing) {
  for (std::size_t bit = 0; bit < 32; ++bit) {
    std::string flipped = whole_;
    flipped[60 + bit / 8] = static_cast<char>(flipped[60 + bit / 8] ^ (1 << (bit % 8)));
    write(flipped);
    const auto lost = salvage();
    ASSERT_TRUE(lost.has_value()) << "bit " << bit << ": " << lost.error().message;
    EXPECT_EQ(taken_, rows_);
  }
}

TEST_F(SqliteSalvage, WhatIsNoStoreOrAnotherIsNotTaken) {
  EXPECT_FALSE(salvage(map_schema()).has_value());
  Schema older = kSchema;
  older.version = 1;
  older.tables = {"apples"};
  EXPECT_EQ(salvage(older).error().code, ErrorCode::unsupported);
  ASSERT_TRUE(write_file(file().string(), "garbage"));
  EXPECT_FALSE(salvage().has_value());
  ASSERT_TRUE(write_file(file().string(), std::string(9000, 'x')));
  EXPECT_NE(salvage().error().message.find("no row of a test"), std::string::npos) << salvage().error().message;
  fs::remove(file());
  EXPECT_FALSE(salvage().has_value());
}

}  // namespace sqlite_salvage_test
}  // namespace tutti::storage
