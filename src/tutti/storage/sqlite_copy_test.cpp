// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_copy.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tutti/storage/sqlite_store.hpp"

namespace tutti::storage {
namespace sqlite_copy_test {

namespace fs = std::filesystem;

const Schema kSchema{.kind = "test", .version = 1, .tables = {"apples", "pears"}};

class SqliteCopy : public ::testing::Test {
 protected:
  SqliteCopy() { fs::create_directories(folder_); }
  ~SqliteCopy() override { fs::remove_all(folder_); }
  static std::unique_ptr<TableStore> open(const fs::path& file) {
    auto store = open_sqlite_store(file, kSchema, {.min_free_bytes = 0});
    EXPECT_TRUE(store.has_value()) << store.error().message;
    return std::move(*store);
  }
  fs::path folder_ = fs::path(::testing::TempDir()) / ("sqlite_copy_" + std::to_string(getpid()));
  fs::path file_ = folder_ / "some.tutti", copy_ = folder_ / "copy.tutti";
};

constexpr int kFirst = -40;  // so that the file takes some time to copy

/// One transaction: the number, in both tables, a row of its own, and bytes that make the log begin anew every few of
/// them.
std::vector<Write> numbered(int number) {
  const std::string text = std::to_string(number), filling(300'000, static_cast<char>('a' + std::abs(number) % 26));
  return {{"apples", "n", text},
          {"apples", "filling/" + std::to_string(std::abs(number) % 20), filling},
          {"pears", "n", text},
          {"pears", "row/" + text, std::string(3000, 'r')}};
}

/// The number, if the rows of all before it are there.
int number_in(const TableStore& store) {
  const auto apples = store.read("apples", "n").value(), pears = store.read("pears", "n").value();
  EXPECT_EQ(apples, pears);
  const int number = apples ? std::stoi(*apples) : kFirst - 1;
  int rows = 0;
  EXPECT_TRUE(store.scan("pears", "row/", [&](std::string_view, std::string_view) { return ++rows > 0; }));
  EXPECT_EQ(rows, number - kFirst + 1);
  return number;
}

TEST_F(SqliteCopy, IsWhatWasCommittedAtSomeTimeWhileOthersCommit) {
  const auto store = open(file_);
  std::atomic<int> committed = 0;
  for (int i = kFirst; i <= 0; ++i) ASSERT_TRUE(store->commit(numbered(i)));
  std::jthread writer([&](const std::stop_token& stop) {
    for (int i = 1; !stop.stop_requested(); ++i) {
      ASSERT_TRUE(store->commit(numbered(i)));
      committed = i;
    }
  });
  int copies = 0, last = 0;
  for (int i = 0; i < 30; ++i) {
    const int before = committed;
    if (const Status copied = copy_sqlite_store(file_, copy_); !copied) {
      EXPECT_NE(copied.error().message.find("changes faster"), std::string::npos) << copied.error().message;
      continue;
    }
    const int number = number_in(*open(copy_));  // which checks all of the file
    EXPECT_GE(number, before);
    EXPECT_LE(number, committed + 1);  // stored, and not counted yet
    ++copies;
    last = number;
  }
  EXPECT_GT(copies, 0);
  writer.request_stop();
  writer.join();
  EXPECT_GT(last, 0);
  EXPECT_EQ(number_in(*store), committed);  // nothing was disturbed
}

TEST_F(SqliteCopy, OfAClosedStoreIsTheStore) {
  ASSERT_TRUE(open(file_)->commit(numbered(kFirst)));
  fs::copy_file(file_, copy_);
  std::ofstream(copy_.string() + "-wal") << "of another store";
  ASSERT_TRUE(copy_sqlite_store(file_, copy_));
  EXPECT_EQ(number_in(*open(copy_)), kFirst);
}

TEST_F(SqliteCopy, WhatCannotBeCopiedIsReported) {
  const auto expect_error = [&](const fs::path& from, const char* text) {
    const Status copied = copy_sqlite_store(from, copy_);
    ASSERT_FALSE(copied.has_value());
    EXPECT_NE(copied.error().message.find(text), std::string::npos) << copied.error().message;
  };
  expect_error(file_, "some.tutti: cannot be copied");
  std::ofstream(file_) << "half";
  std::ofstream(file_.string() + "-journal") << "of its making";
  expect_error(file_, "is just being made");
}

}  // namespace sqlite_copy_test
}  // namespace tutti::storage
