// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/stamp_watch.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tutti::robot {
namespace stamp_watch_test {

using Verdict = StampWatch::Verdict;
constexpr Timestamp kStart{1'700'000'000'000'000'000LL};
constexpr double kHour_s = 3600.0;

class StampWatchTest : public testing::TestWithParam<double> {
 protected:
  /// So many stamps at the rate, from `from_s` on; the number of each verdict.
  std::size_t count(double from_s, int stamps, Verdict of) {
    std::size_t out = 0;
    for (int i = 0; i < stamps; ++i) out += watch_.take(kStart + (from_s + i / GetParam())) == of ? 1 : 0;
    return out;
  }
  StampWatch watch_;
};

INSTANTIATE_TEST_SUITE_P(AtRates, StampWatchTest, testing::Values(0.5, 1.0, 20.0, 200.0, 1000.0));

TEST_P(StampWatchTest, OneStampInTheFutureChangesNothing) {
  EXPECT_EQ(count(0.0, 100, Verdict::follows), 100U);
  const double next_s = 100 / GetParam();
  EXPECT_EQ(watch_.take(kStart + kHour_s), Verdict::waits);
  EXPECT_EQ(watch_.take(kLastTimestamp), Verdict::waits);
  EXPECT_EQ(count(next_s, 100, Verdict::follows), 100U);
  EXPECT_EQ(watch_.take(kStart + kHour_s + 1.0), Verdict::waits);  // the one before it is forgotten
}

TEST_P(StampWatchTest, AFarStepCountsOnceASecondStampConfirmsIt) {
  count(0.0, 100, Verdict::follows);
  EXPECT_EQ(watch_.take(kStart + kHour_s), Verdict::waits);
  EXPECT_EQ(watch_.take(kStart + kHour_s), Verdict::waits);  // twice the same confirms nothing
  EXPECT_EQ(watch_.take(kStart + kHour_s + 1 / GetParam()), Verdict::confirms);
  EXPECT_EQ(count(kHour_s + 2 / GetParam(), 100, Verdict::follows), 100U);
}

TEST_P(StampWatchTest, AClockThatGoesBackBeginsAnewWithinSeconds) {
  for (const double back_s : {-3 * kHour_s, -1.7e9}) {
    watch_ = StampWatch(kStart);
    int before = 0;
    while (watch_.take(kStart + (back_s + before / GetParam())) == Verdict::is_before) ++before;
    EXPECT_LE(before / GetParam(), std::max(StampWatch::kAnew_s, 2 / GetParam()) + 1 / GetParam());
    EXPECT_GE(before / GetParam(), StampWatch::kAnew_s);
    EXPECT_EQ(count(back_s + (before + 1) / GetParam(), 100, Verdict::follows), 100U);
  }
}

// Two publishers with two clocks: the first one goes on, and the other never takes its place.
TEST_P(StampWatchTest, StampsOfTwoClocksInTurnAreOfTheFirst) {
  for (const double other_s : {-kHour_s, kHour_s}) {
    watch_ = StampWatch(kStart);
    for (int i = 1; i < 2000; ++i) {
      ASSERT_EQ(watch_.take(kStart + i / GetParam()), Verdict::follows);
      const Verdict of_other = watch_.take(kStart + (other_s * GetParam() * 10 + i / GetParam()));
      ASSERT_TRUE(of_other == Verdict::is_before || of_other == Verdict::waits);
    }
  }
}

TEST_P(StampWatchTest, WhatComesAgainOrOutOfOrderIsNoOtherClock) {
  count(0.0, 100, Verdict::follows);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(watch_.take(kStart + (99 - i) / GetParam()), Verdict::is_before);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(watch_.take(kStart), Verdict::is_before);
}

TEST(StampWatch, ABreakOfAMinuteNeedsNoConfirmation) {
  StampWatch watch(kStart);
  EXPECT_EQ(watch.take(kStart + 59.9), Verdict::follows);
  EXPECT_EQ(watch.take(kStart + 120.0), Verdict::waits);
  EXPECT_EQ(watch.newest(), kStart + 59.9);
}

}  // namespace stamp_watch_test
}  // namespace tutti::robot
