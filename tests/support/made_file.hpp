// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "support/paths.hpp"

namespace tutti::test {

/// Fails if a file of this checkout, which is committed, is not what the test has made; with TUTTI_WRITE=1 it becomes
/// that.
inline void expect_made(const std::string& file, const std::string& made) {
  const std::filesystem::path path = source_path(file);
  if (std::getenv("TUTTI_WRITE") != nullptr) std::ofstream(path, std::ios::binary) << made;
  std::ostringstream committed;
  committed << std::ifstream(path, std::ios::binary).rdbuf();
  const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
  EXPECT_TRUE(committed.str() == made) << file << " is not what the lists of fields make. To renew it: TUTTI_WRITE=1 "
                                       << std::filesystem::read_symlink("/proc/self/exe").string()
                                       << " --gtest_filter=" << test->test_suite_name() << "." << test->name();
}

}  // namespace tutti::test
