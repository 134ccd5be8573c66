// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/thinning.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <set>

namespace tutti::history {
namespace thinning_test {

using Times = std::vector<std::int64_t>;

Times thinned(const Times& times, std::int64_t now_ms, std::uint32_t per_age) {
  const auto gone = surplus(times, now_ms, per_age);
  Times out;
  for (std::size_t i = 0; i < times.size(); ++i)
    if (std::ranges::find(gone, i) == gone.end()) out.push_back(times[i]);
  return out;
}

/// Ascending, from 0 on.
Times any_times() {
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(1, 5000));
  Times out{0};
  for (const int step : steps) out.push_back(out.back() + step);
  return out;
}

/// Whether each value that is gone has one in its place that is hardly younger.
void check_gaps(const Times& all, const Times& left, std::int64_t now_ms, std::uint32_t per_age, std::int64_t factor) {
  for (const std::int64_t time : all) {
    const auto after = std::ranges::lower_bound(left, time);
    RC_ASSERT(after != left.end());
    RC_ASSERT(*after - time <= factor * spacing_ms(now_ms - time, per_age));
  }
}

RC_GTEST_PROP(Thinning, WhatIsGoneHasSomethingHardlyYoungerInItsPlace, ()) {
  const Times times = any_times();
  const auto per_age = *rc::gen::inRange<std::uint32_t>(1, 50);
  const std::int64_t now_ms = times.back() + *rc::gen::inRange(0, 1'000'000);
  const Times left = thinned(times, now_ms, per_age);
  RC_ASSERT(left.front() == times.front());
  RC_ASSERT(left.back() == times.back());
  check_gaps(times, left, now_ms, per_age, 1);
  RC_ASSERT(thinned(left, now_ms, per_age) == left);
}

RC_GTEST_PROP(Thinning, ThinnedAgainAndAgainItIsNotMuchCoarserThanThinnedOnce, ()) {
  const Times times = any_times();
  const auto per_age = *rc::gen::inRange<std::uint32_t>(2, 50);
  Times left;
  for (const std::int64_t time : times) {
    left.push_back(time);
    left = thinned(left, time, per_age);
  }
  check_gaps(times, left, times.back(), per_age, 2);
}

RC_GTEST_PROP(Thinning, FewAreLeftOfEachDoublingOfAge, ()) {
  const Times times = any_times();
  const auto per_age = *rc::gen::inRange<std::uint32_t>(1, 50);
  const std::int64_t now_ms = times.back();
  const Times left = thinned(times, now_ms, per_age);
  for (std::int64_t age = per_age; age < now_ms; age *= 2) {
    const auto count = std::ranges::count_if(
        left, [&](std::int64_t time) { return time > 0 && now_ms - time >= age && now_ms - time < 2 * age; });
    RC_ASSERT(count <= 2 * static_cast<std::int64_t>(per_age) + 2);
  }
}

TEST(Thinning, ADayOfStatusesIsAThousand) {
  Times times;
  for (std::int64_t t = 0; t <= 86'400'000; t += 2000) times.push_back(t);
  EXPECT_LT(thinned(times, times.back(), 100).size(), 1400U);
  EXPECT_GT(thinned(times, times.back(), 100).size(), 700U);
  EXPECT_EQ(thinned(times, times.back(), 0).size(), times.size()) << "0 keeps all";
}

}  // namespace thinning_test
}  // namespace tutti::history
