// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/guarded_server.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

namespace tutti::page {
namespace guarded_server_test {

/// On a busy machine the thread that listens may begin only after the mission has ended.
TEST(GuardedServer, ListensNoMoreOnceEnded) {
  GuardedServer server;
  ASSERT_GT(server.bind("127.0.0.1", 0), 0);
  server.end();
  auto listens = std::async(std::launch::async, [&] { server.listen(); });
  EXPECT_EQ(listens.wait_for(std::chrono::seconds(10)), std::future_status::ready);
}

}  // namespace guarded_server_test
}  // namespace tutti::page
