// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/own_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tutti/base/file.hpp"

namespace tutti {
namespace own_file_test {

namespace fs = std::filesystem;

class OwnFileTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ASSERT_TRUE(write_file(foreign_.string(), "of somebody else"));
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_ = fs::path(testing::TempDir()) / ("own_file_" + std::to_string(getpid()));
  fs::path foreign_ = folder_ / "foreign";
  fs::path file_ = folder_ / "status.json";
};

TEST_F(OwnFileTest, IsReplacedWhole) {
  ASSERT_TRUE(replace_file(file_, "first", true));
  ASSERT_TRUE(replace_file(file_, "second", false));
  EXPECT_EQ(read_file(file_.string()).value(), "second");
  EXPECT_FALSE(fs::exists(beside_of(file_)));
  EXPECT_FALSE(replace_file(folder_ / "nowhere" / "x", "x", false));
}

TEST_F(OwnFileTest, NothingIsWrittenThroughALink) {
  fs::create_symlink(foreign_, beside_of(file_));
  ASSERT_TRUE(replace_file(file_, "mine", false));
  fs::create_symlink(foreign_, folder_ / "log.txt");
  const auto refused = open_own_file(folder_ / "log.txt", O_WRONLY | O_CREAT | O_APPEND);
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("symbolic link"), std::string::npos) << refused.error().message;
  fs::create_hard_link(foreign_, beside_of(file_));
  ASSERT_TRUE(replace_file(file_, "mine", false));
  EXPECT_EQ(read_file(foreign_.string()).value(), "of somebody else");
  EXPECT_EQ(read_file(file_.string()).value(), "mine");
  EXPECT_FALSE(fs::is_symlink(file_));
}

TEST_F(OwnFileTest, WhatIsNoRegularFileIsRefusedAtOnce) {
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  EXPECT_FALSE(open_own_file(folder_ / "fifo", O_RDWR).has_value());
  EXPECT_FALSE(open_own_file(folder_, O_RDONLY).has_value());
}

}  // namespace own_file_test
}  // namespace tutti
