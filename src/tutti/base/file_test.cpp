// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace file_test {

TEST(Files, MissingAndFolderAreIoErrors) {
  for (const std::string path : {"/does/not/exist", "."}) {
    const auto bytes = read_file(path);
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, ErrorCode::io);
    EXPECT_TRUE(bytes.error().message.starts_with(path));
  }
  EXPECT_FALSE(write_file("/does/not/exist", "x"));
}

TEST(Files, BytesSurviveDisk) {
  std::string bytes(600'000, '\0');  // several chunks
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 2654435761U >> 13U);
  const std::string path = testing::TempDir() + "tutti_file_test.bin";
  ASSERT_TRUE(write_file(path, bytes));
  EXPECT_EQ(read_file(path).value(), bytes);
}

}  // namespace file_test
}  // namespace tutti
