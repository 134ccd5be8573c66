// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/timestamp.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <unordered_set>
#include <vector>

namespace tutti {
namespace timestamp_test {

constexpr Timestamp kEpoch{1'403'636'579'763'555'584};  // a EuRoC stamp: doubles are 256 ns apart here

TEST(Timestamp, DifferencesKeepEveryNanosecond) {
  for (const std::int64_t ns : {0LL, 1LL, -1LL, 255LL, 10'000'000LL, 3'600'000'000'001LL}) {
    const Timestamp later{kEpoch.ns + ns};
    EXPECT_DOUBLE_EQ(later - kEpoch, static_cast<double>(ns) * 1e-9);
    EXPECT_DOUBLE_EQ(kEpoch - later, static_cast<double>(-ns) * 1e-9);
  }
}

TEST(Timestamp, AddingSecondsIsExactToTheNanosecond) {
  EXPECT_EQ((kEpoch + 1e-9).ns, kEpoch.ns + 1);
  EXPECT_EQ((kEpoch + 0.05).ns, kEpoch.ns + 50'000'000);
  EXPECT_EQ((kEpoch - 0.05).ns, kEpoch.ns - 50'000'000);
  EXPECT_EQ((kEpoch + 86400.0).ns, kEpoch.ns + 86'400'000'000'000);
  EXPECT_EQ((kEpoch + 0.1) - 0.1, kEpoch);
  EXPECT_EQ(kEpoch + (-2.5), kEpoch - 2.5);
  EXPECT_EQ((kEpoch + 4e-10).ns, kEpoch.ns);  // rounds to the nearest
  EXPECT_EQ((kEpoch + 6e-10).ns, kEpoch.ns + 1);
}

TEST(Timestamp, BeforeTheEpochDoesNotWrap) {
  EXPECT_DOUBLE_EQ((Timestamp{-1'000'000'000} - Timestamp{1'000'000'000}), -2.0);
  EXPECT_LT(Timestamp{-1}, Timestamp{0});
}

TEST(Timestamp, StaysAtTheFirstAndTheLastThereIs) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double forever : {kInfinity, 1e10, 1e300}) {
    EXPECT_EQ(kEpoch + forever, kLastTimestamp);
    EXPECT_EQ(kEpoch - forever, kFirstTimestamp);
    EXPECT_EQ(kEpoch - -forever, kLastTimestamp);
    EXPECT_EQ(kLastTimestamp + forever, kLastTimestamp);
  }
  EXPECT_EQ(kLastTimestamp + 1e-9, kLastTimestamp);
  EXPECT_EQ(kFirstTimestamp - 1.0, kFirstTimestamp);
  EXPECT_EQ((kEpoch + 7e9).ns, kEpoch.ns + 7'000'000'000'000'000'000);
  EXPECT_EQ(kEpoch + 8e9, kLastTimestamp);  // the sum wraps, not the step
  EXPECT_NEAR(kLastTimestamp - kFirstTimestamp, 0x1p64 * 1e-9, 1.0);
  EXPECT_NEAR(kFirstTimestamp - kLastTimestamp, -0x1p64 * 1e-9, 1.0);
}

TEST(Timestamp, OrdersAndHashesByNanosecond) {
  EXPECT_LT(kEpoch, Timestamp{kEpoch.ns + 1});
  EXPECT_EQ((std::unordered_set<Timestamp>{kEpoch, kEpoch, Timestamp{kEpoch.ns + 1}}.size()), 2U);
}

TEST(Timestamp, TheTypicalGapIsTheMedian) {
  EXPECT_EQ(typical_gap_s({}), 0.0);
  EXPECT_EQ(typical_gap_s(std::vector{kEpoch}), 0.0);
  EXPECT_NEAR(typical_gap_s(std::vector{kEpoch, kEpoch + 0.1, kEpoch + 0.2, kEpoch + 9.0}), 0.1, 1e-9);
}

}  // namespace timestamp_test
}  // namespace tutti
