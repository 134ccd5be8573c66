// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/stamp_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(StampOrder, HeadersWithoutStampsAreCalledSo) {
  const StampOrder order = order_of({0, 0, 0});
  ASSERT_EQ(order.refused.size(), 2U);
  EXPECT_EQ(order.refused[0].second,
            "stamp 0 ns, which another message has, too: its publisher does not fill header.stamp");
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

/// Drivers stamp by a clock that is not set yet at first, or not at all.
TEST(StampOrder, WhatCameBeforeTheClockWasSetIsARunOfItsOwn) {
  constexpr int kSet = 17'000'000;  // tenths: 20 days
  for (const auto& before : {std::vector<int>(20, 0), counting(0, 20)}) {
    const StampOrder order = order_of(before + counting(kSet, kSet + 200));
    EXPECT_EQ(order.used.size(), 200U);
    ASSERT_EQ(order.runs.size(), 2U);
    EXPECT_EQ(order.run, 1U);
  }
  EXPECT_EQ(order_of(counting(0, 50) + std::vector<int>{kSet} + counting(50, 100)).used.size(), 100U);
}

/// A gap, as of a recorder that was stopped, is none.
TEST(StampOrder, ALongGapIsNoNewClock) {
  const StampOrder order = order_of(counting(0, 50) + counting(9000, 9050));
  EXPECT_EQ(order.used.size(), 100U);
  EXPECT_EQ(order.runs.size(), 1U);
}

TEST(StampOrder, ChunksInAnyOrderAreReadByTheirLogTimes) {
  const auto logged = [](std::initializer_list<std::pair<int, int>> ranges) {
    std::vector<Arrival> out;
    for (const auto& [from, to] : ranges)
      for (int i = from; i < to; ++i) out.push_back({Timestamp{i * 100'000'000LL}, Timestamp{i * 100'000'000LL}, 0});
    return out;
  };
  const auto swapped = log_order(logged({{200, 300}, {0, 100}, {300, 400}, {100, 200}}));
  EXPECT_EQ(swapped[0], 100U);
  EXPECT_EQ(swapped[100], 300U);
  EXPECT_EQ(swapped[399], 299U);
  auto shuffled = logged({{0, 100}});
  for (std::size_t i = 0; i < shuffled.size(); ++i) std::swap(shuffled[i], shuffled[(37 * i) % 100]);
  const auto sorted = log_order(shuffled);
  for (std::size_t i = 0; i < sorted.size(); ++i)
    EXPECT_EQ(shuffled[sorted[i]].logged.ns, static_cast<std::int64_t>(i) * 100'000'000);
  std::vector<Arrival> exchanged = logged({{0, 70}});  // short chunks of a topic that is not often in them
  for (std::size_t at = 0; at + 8 <= exchanged.size(); at += 16)
    std::swap_ranges(exchanged.begin() + static_cast<std::ptrdiff_t>(at),
                     exchanged.begin() + static_cast<std::ptrdiff_t>(at + 4),
                     exchanged.begin() + static_cast<std::ptrdiff_t>(at + 4));
  const auto in_time = log_order(exchanged);
  for (std::size_t i = 0; i < in_time.size(); ++i)
    EXPECT_EQ(exchanged[in_time[i]].logged.ns, static_cast<std::int64_t>(i) * 100'000'000);
  const auto again = log_order(logged({{0, 300}, {0, 200}}));  // the recorder's clock started again
  EXPECT_TRUE(std::ranges::is_sorted(again));
}

}  // namespace stamp_order_test
}  // namespace tutti::bags
