// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

namespace tutti::test {

/// Whether the Debian package nats-server is there, or one in a usual place.
inline bool nats_server_is_installed() {
  for (const char* folder : {"/usr/sbin", "/usr/bin", "/usr/local/sbin", "/usr/local/bin"})
    if (std::filesystem::exists(std::filesystem::path(folder) / "nats-server")) return true;
  return false;
}

}  // namespace tutti::test

/// In a test or its SetUp().
#define TUTTI_SKIP_WITHOUT_NATS_SERVER() \
  if (!tutti::test::nats_server_is_installed()) GTEST_SKIP() << "nats-server is not installed: nothing was tried"
