// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/connections.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <vector>

namespace tutti::page {
namespace connections_test {

/// The server's end of a connection; the peer's tells whether it was ended.
class Pair {
 public:
  Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends_.data()), 0); }
  ~Pair() {
    for (const int end : ends_) ::close(end);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  [[nodiscard]] int server() const { return ends_[0]; }
  [[nodiscard]] bool is_ended() const {
    char byte = 0;
    return recv(ends_[1], &byte, 1, MSG_DONTWAIT) == 0;
  }

 private:
  std::array<int, 2> ends_{};
};

TEST(Connections, RoomIsMadeByWhoseAddressHasMostAndWhoWaitsLongest) {
  Connections connections;
  const std::array<Pair, 5> pairs;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    ASSERT_TRUE(connections.enter(pairs[i].server(), i == 0 ? "192.0.2.1" : "192.0.2.2"));
  connections.waits(pairs[0].server(), 1.0);  // the longest, but alone
  connections.waits(pairs[2].server(), 4.0);
  connections.waits(pairs[3].server(), 3.0);
  connections.waits(pairs[4].server(), 9.8);
  std::vector<std::size_t> ended;
  for (int i = 0; i < 5; ++i) {
    connections.make_room(10.0);
    for (std::size_t k = 0; k < pairs.size(); ++k)
      if (pairs[k].is_ended() && std::ranges::find(ended, k) == ended.end()) ended.push_back(k);
  }
  EXPECT_EQ(ended, (std::vector<std::size_t>{3, 2, 0})) << "1 is served, and 4 has waited for too short a time";
  connections.waits(pairs[4].server(), std::nullopt);
  EXPECT_FALSE(connections.make_room(99.0)) << "who is served stays";
}

TEST(Connections, NobodyEntersOnceClosed) {
  Connections connections;
  const Pair one, late;
  ASSERT_TRUE(connections.enter(one.server(), "192.0.2.1"));
  connections.close();
  EXPECT_TRUE(one.is_ended());
  EXPECT_FALSE(connections.enter(late.server(), "192.0.2.1"));
}

}  // namespace connections_test
}  // namespace tutti::page
