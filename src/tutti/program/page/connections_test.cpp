// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/connections.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <string>
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

constexpr double kNow_s = 10.0;

/// Fills all places, two or three of each address, by connections that are served.
std::vector<Pair> all_places(Connections& connections) {
  std::vector<Pair> out(Connections::kMost);
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_TRUE(connections.enter(out[i].server(), "198.51.100." + std::to_string(i % 100), kNow_s));
    connections.waits(out[i].server(), std::nullopt);
  }
  return out;
}

TEST(Connections, RoomIsMadeByWhoseAddressHasMostAndWhoWaitsLongest) {
  Connections connections;
  const std::vector<Pair> pairs = all_places(connections);  // addresses 0 to 55 have three, the others two
  connections.waits(pairs[99].server(), 1.0);               // the longest, but one of two
  connections.waits(pairs[100].server(), 4.0);
  connections.waits(pairs[101].server(), 3.0);
  const std::array<Pair, 4> newcomers;
  const auto is_let_in = [&](std::size_t i) {
    return connections.enter(newcomers.at(i).server(), "192.0.2." + std::to_string(i), kNow_s);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(is_let_in(i));
    connections.waits(newcomers.at(i).server(), std::nullopt);
    EXPECT_TRUE(pairs[101].is_ended());
    EXPECT_EQ(pairs[100].is_ended(), i >= 1);
    EXPECT_EQ(pairs[99].is_ended(), i >= 2);
  }
  EXPECT_FALSE(is_let_in(3)) << "who is served stays";
}

TEST(Connections, AnAddressHasItsShare) {
  Connections connections;
  const std::array<Pair, Connections::kMostOfAddress> pairs;
  for (const Pair& pair : pairs) {
    ASSERT_TRUE(connections.enter(pair.server(), "192.0.2.1", kNow_s));
    connections.waits(pair.server(), std::nullopt);
  }
  const Pair another, more, newest;
  ASSERT_TRUE(connections.enter(another.server(), "192.0.2.2", 1.0)) << "there are places for others";
  EXPECT_FALSE(connections.enter(more.server(), "192.0.2.1", kNow_s)) << "all of it are served";
  connections.waits(pairs[3].server(), 9.9);
  EXPECT_TRUE(connections.enter(newest.server(), "192.0.2.1", kNow_s));
  EXPECT_TRUE(pairs[3].is_ended());
  EXPECT_FALSE(another.is_ended()) << "it has waited longer, but is none of his";
  connections.leave(pairs[3].server());
  connections.leave(pairs[4].server());
  EXPECT_TRUE(connections.enter(more.server(), "192.0.2.1", kNow_s));
}

TEST(Connections, NobodyEntersOnceClosed) {
  Connections connections;
  const Pair one, late;
  ASSERT_TRUE(connections.enter(one.server(), "192.0.2.1", kNow_s));
  connections.close();
  EXPECT_TRUE(one.is_ended());
  EXPECT_FALSE(connections.enter(late.server(), "192.0.2.1", kNow_s));
}

}  // namespace connections_test
}  // namespace tutti::page
