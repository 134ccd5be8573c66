// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/folder.hpp"

#include <gtest/gtest.h>

#include "tutti/base/file.hpp"

namespace tutti {
namespace folder_test {

TEST(Folders, AreMadeWithThoseAboveThem) {
  const std::filesystem::path base = testing::TempDir() + "tutti_folder_test";
  std::filesystem::remove_all(base);
  EXPECT_TRUE(make_folder_of(base / "a" / "b" / "file"));
  EXPECT_TRUE(std::filesystem::is_directory(base / "a" / "b"));
  EXPECT_FALSE(std::filesystem::exists(base / "a" / "b" / "file"));
  EXPECT_TRUE(make_folder(base / "a" / "b"));  // it is there
  EXPECT_TRUE(make_folder_of("file"));
  ASSERT_TRUE(write_file((base / "file").string(), "x"));
  const Status made = make_folder_of(base / "file" / "c" / "d");
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::io);
  EXPECT_NE(made.error().message.find("file/c: cannot make the folder"), std::string::npos) << made.error().message;
  std::filesystem::remove_all(base);
}

}  // namespace folder_test
}  // namespace tutti
