// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

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
  EXPECT_EQ(read_file(path, bytes.size()).value(), bytes);
  EXPECT_EQ(read_file(path, bytes.size() - 1).error().message, path + ": has more than 599999 bytes");
}

/// A pipe may never be written to, and a device never end.
TEST(Files, AnInputIsARegularFile) {
  const std::string pipe = testing::TempDir() + fmt::format("tutti_file_test_{}.pipe", getpid());
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(read_file(pipe).error().message, pipe + ": is a pipe, expected a file");
  std::filesystem::remove(pipe);
  EXPECT_EQ(read_file("/dev/zero").error().message, "/dev/zero: is a device, expected a file");
  EXPECT_EQ(open_file("/").error().message, "/: is a folder, expected a file");
  EXPECT_FALSE(read_file("/proc/self/status").value().empty());  // of no size
}

}  // namespace file_test
}  // namespace tutti
