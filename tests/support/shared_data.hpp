// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "support/paths.hpp"

/// Skips the test, saying so, when the shared file or folder is not there.
#define TUTTI_REQUIRE_SHARED(relative)                                \
  if (!std::filesystem::exists(::tutti::test::shared_path(relative))) \
  GTEST_SKIP() << "needs " << ::tutti::test::shared_path(relative) << ", which is not beside this checkout"
