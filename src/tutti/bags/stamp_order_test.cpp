// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/stamp_order.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace tutti::bags {
namespace stamp_order_test {

/// Stamps in tenths of a second.
StampOrder order_of(const std::vector<int>& tenths) {
  std::vector<Arrival> arrivals;
  for (const int tenth : tenths) arrivals.push_back({Timestamp{} + 0.1 * tenth, Timestamp{} + 0.1 * tenth});
  return order_by_stamp(arrivals);
}
std::vector<int> counting(int from, int to) {
  std::vector<int> out(static_cast<std::size_t>(to - from));
  std::iota(out.begin(), out.end(), from);
  return out;
}
std::vector<int> operator+(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(StampOrder, WhatComesLateIsSortedInAndWhatComesTwiceIsRefused) {
  const StampOrder order = order_of({0, 2, 1, 3, 3, 6, 5, 4, 7});
  EXPECT_EQ(order.used, (std::vector<std::size_t>{0, 2, 1, 3, 7, 6, 5, 8}));
  EXPECT_EQ(order.late, 3U);
  ASSERT_EQ(order.refused.size(), 1U);
  EXPECT_EQ(order.refused[0].first, 4U);
  EXPECT_EQ(order.runs.size(), 1U);
  EXPECT_EQ(order.in_words(), "");
  EXPECT_TRUE(order_of({}).used.empty());
}

TEST(StampOrder, SingleStampsThatAreFarOffAreRefused) {
  const StampOrder ahead = order_of(counting(100, 150) + std::vector<int>{9000} + counting(150, 200));
  EXPECT_EQ(ahead.used.size(), 100U);
  EXPECT_EQ(ahead.runs.size(), 1U);
  ASSERT_EQ(ahead.refused.size(), 1U);
  EXPECT_EQ(ahead.refused[0].first, 50U);
  const StampOrder behind = order_of(counting(100, 150) + std::vector<int>{7} + counting(150, 200));
  EXPECT_EQ(behind.used.size(), 100U);
  ASSERT_EQ(behind.refused.size(), 1U);
  EXPECT_EQ(behind.refused[0].second, "stamp 700000000 ns is 14.2 s behind 14900000000 ns, expected within 1 s");
}

TEST(StampOrder, OfAClockThatStartsAgainTheLongestRunIsUsed) {
  const StampOrder order = order_of(counting(500, 530) + counting(0, 100) + counting(20, 60));
  ASSERT_EQ(order.runs.size(), 3U);
  EXPECT_EQ(order.run, 1U);
  EXPECT_EQ(order.used.size(), 100U);
  EXPECT_EQ(order.used.front(), 30U);
  EXPECT_EQ(order.in_words(),
            "its clock starts again 2 times: messages 1 to 30 last 2.9 s from 50000000000 ns on (left out), messages "
            "31 to 130 last 9.9 s from 0 ns on (used), messages 131 to 170 last 3.9 s from 2000000000 ns on (left "
            "out)");
}

/// A gap, as of a recorder that was stopped, is none.
TEST(StampOrder, ALongGapIsNoNewClock) {
  const StampOrder order = order_of(counting(0, 50) + counting(9000, 9050));
  EXPECT_EQ(order.used.size(), 100U);
  EXPECT_EQ(order.runs.size(), 1U);
}

}  // namespace stamp_order_test
}  // namespace tutti::bags
