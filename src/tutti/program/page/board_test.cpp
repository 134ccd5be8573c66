// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/board.hpp"

#include <gtest/gtest.h>

namespace tutti::page {
namespace board_test {

std::vector<std::string> keys(const Board& board, std::uint64_t after) {
  std::vector<std::string> out;
  for (const auto& message : board.after(after)) out.push_back(message->message().key + "=" + message->message().value);
  return out;
}
using Keys = std::vector<std::string>;

TEST(Board, GivesWhoComesLateTheLastOfEachKeyInOrder) {
  Board board;
  EXPECT_TRUE(board.put({"a", 1.0, "1"}));
  EXPECT_TRUE(board.put({"b", 1.0, "1"}));
  EXPECT_TRUE(board.put({"a", 2.0, "2"}));
  EXPECT_EQ(keys(board, 0), (Keys{"b=1", "a=2"}));
  const auto seen = board.sequence();
  EXPECT_FALSE(board.put({"b", 3.0, "1"})) << "nothing new";
  EXPECT_EQ(keys(board, seen), Keys());
  board.put({"b", 3.0, "2"});
  EXPECT_EQ(keys(board, seen), Keys{"b=2"});
}

/// Thirty-two who watch a map of 100 MB take no 3 GB.
TEST(Board, HasOneTextForAllWhoWatch) {
  Board board;
  board.put({"a", 1.0, "[1]"});
  const auto one = board.after(0), other = board.after(0);
  EXPECT_EQ(one.front()->json(), R"({"key":"a","t":1.0,"value":[1]})");
  EXPECT_EQ(one.front()->json().data(), other.front()->json().data());
  EXPECT_EQ(one.front()->value(), "[1]");
  EXPECT_EQ(one.front()->message(), (Message{"a", 1.0, "[1]"}));
  EXPECT_EQ(one.front()->sequence(), 1U);
}

TEST(Board, EndsWhatIsNoLongerAmongThoseOfAPrefix) {
  Board board;
  board.put({"closurex", 0.0, "1"});
  board.put_all("closure/", {{"closure/a", 1.0, "1"}, {"closure/b", 1.0, "1"}}, 1.0);
  const auto seen = board.sequence();
  board.put_all("closure/", {{"closure/b", 2.0, "1"}, {"closure/c", 2.0, "1"}}, 2.0);
  EXPECT_EQ(keys(board, seen), (Keys{"closure/a=null", "closure/c=1"}));
  board.put_all("closure/", {{"closure/b", 3.0, "1"}, {"closure/c", 3.0, "1"}}, 3.0);
  EXPECT_EQ(board.sequence(), seen + 2) << "what has ended ends once";
}

TEST(Board, WritesAnyKeyAsJson) {
  EXPECT_EQ(to_json({"a\"b", 1.5, "[1]"}), R"({"key":"a\"b","t":1.5,"value":[1]})");
  EXPECT_EQ(to_json({"\xff", 0.0, "null"}), "{\"key\":\"\xEF\xBF\xBD\",\"t\":0.0,\"value\":null}");
}

}  // namespace board_test
}  // namespace tutti::page
