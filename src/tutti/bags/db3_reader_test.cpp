// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/db3_reader.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "support/bags/rosbag2_writer.hpp"

namespace tutti::bags {
namespace db3_reader_test {

namespace fs = std::filesystem;

class Db3 : public ::testing::Test {
 protected:
  ~Db3() override { fs::remove(file_); }
  void change(const char* sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }
  const fs::path file_ = fs::path(::testing::TempDir()) / fmt::format("db3_reader_{}.db3", getpid());
};

struct Read {
  std::vector<std::size_t> sizes;
  std::vector<std::string> errors;
};
Read read_all(Db3Reader reader) {
  Read out;
  while (true) {
    const auto message = reader.next();
    if (!message)
      out.errors.push_back(message.error().message);
    else if (!*message)
      return out;
    else
      out.sizes.push_back((*message)->data.size());
  }
}

TEST_F(Db3, AMessageThatIsTooLongIsOneError) {
  test::write_db3(file_, {{"/a", "pkg/msg/A", 1, std::string(1'000, 'x')},
                          {"/a", "pkg/msg/A", 2, std::string(1'001, 'x')},
                          {"/a", "pkg/msg/A", 3, "x"}});
  const Read read = read_all(Db3Reader::open(file_, 1'000).value());
  EXPECT_EQ(read.sizes, (std::vector<std::size_t>{1'000, 1}));
  EXPECT_EQ(read.errors, (std::vector<std::string>{file_.string() + ": message 2: 1001 bytes, expected at most 1000"}));
  EXPECT_EQ(read_all(Db3Reader::open(file_).value()).sizes.size(), 3U);
}

/// A file of a few kB can claim that its messages are a thousand million zeros each.
TEST_F(Db3, WhatAFileComputesIsBoundedToo) {
  test::write_db3(file_, {{"/a", "pkg/msg/A", 1, "x"}});
  change(
      "ALTER TABLE messages RENAME TO other; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, "
      "timestamp INTEGER, data BLOB GENERATED ALWAYS AS (zeroblob(999999999)) VIRTUAL); INSERT INTO messages "
      "SELECT id, topic_id, timestamp FROM other");
  const Read read = read_all(Db3Reader::open(file_).value());
  EXPECT_TRUE(read.sizes.empty());
  ASSERT_EQ(read.errors.size(), 1U);
  EXPECT_NE(read.errors[0].find("too big"), std::string::npos) << read.errors[0];
}

}  // namespace db3_reader_test
}  // namespace tutti::bags
