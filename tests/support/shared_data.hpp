// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace tutti::test {

/// Path inside the folder of real recordings and golden values beside the checkout (CMake's TUTTI_SHARED_DIR).
inline std::filesystem::path shared_path(const std::string& relative) {
  return std::filesystem::path(TUTTI_SHARED_DIR) / relative;
}

}  // namespace tutti::test

/// Skips the test, saying so, when the shared file or folder is not there.
#define TUTTI_REQUIRE_SHARED(relative)                                \
  if (!std::filesystem::exists(::tutti::test::shared_path(relative))) \
  GTEST_SKIP() << "needs " << ::tutti::test::shared_path(relative) << ", which is not beside this checkout"
