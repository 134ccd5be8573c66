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
  [[nodiscard]] Result<std::vector<LostRow>> salvage(const Schema& schema = kSchema) {
    taken_.clear();
    return salvage_sqlite_store(file(), schema, [&](std::string_view table, std::string_view key, std::string_view b) {
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

/// Every page but the first, one at a time, as garbage: what is taken is right, and one page costs no table.
TEST_F(SqliteSalvage, APageOfGarbageCostsWhatWasOnIt) {
  Rng rng(2);
  std::size_t fewest = rows_.size();
  const std::size_t pages = whole_.size() / kPageBytes;
  for (std::size_t page = 1; page < pages; page += pages / 60) {
    std::string damaged = whole_;
    for (std::size_t i = 0; i < kPageBytes; ++i) damaged[page * kPageBytes + i] = static_cast<char>(rng.index(256));
    ASSERT_TRUE(write_file(file().string(), damaged));
    for (const char* end : {"-wal", "-shm", "-journal"}) fs::remove(file().string() + end);
    const auto lost = salvage();
    if (!lost) continue;  // the page says what the tables are
    for (const auto& [name, bytes] : taken_) EXPECT_EQ(rows_.at(name), bytes);
    EXPECT_TRUE(taken_.size() == rows_.size() || !lost->empty());
    if (taken_.size() >= rows_.size() / 2) fewest = std::min(fewest, taken_.size());
    if (taken_.size() < rows_.size() / 2) {
      ADD_FAILURE() << "page " << page << " costs " << rows_.size() - taken_.size();
    }
  }
  RecordProperty("fewest_rows", static_cast<int>(fewest));
  EXPECT_LT(fewest, rows_.size());
}

TEST_F(SqliteSalvage, WhatIsNoStoreOrAnotherIsNotTaken) {
  EXPECT_FALSE(salvage(map_schema()).has_value());
  Schema older = kSchema;
  older.version = 1;
  EXPECT_EQ(salvage(older).error().code, ErrorCode::unsupported);
  ASSERT_TRUE(write_file(file().string(), "garbage"));
  EXPECT_FALSE(salvage().has_value());
  fs::remove(file());
  EXPECT_FALSE(salvage().has_value());
}

}  // namespace sqlite_salvage_test
}  // namespace tutti::storage
