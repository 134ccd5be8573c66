// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/missed_count.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tutti::intake {
namespace missed_count_test {

constexpr std::int64_t kPeriod = 5'000'000;  // 200 Hz

TEST(MissedCount, IsHowManyAreNotHeardWhateverTheJitter) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> jitter(-kPeriod / 10, kPeriod / 10);
  for (const double share : {0.0, 0.01, 0.3, 0.5}) {
    std::bernoulli_distribution is_lost(share);
    MissedCount missed;
    std::uint64_t lost = 0;
    for (int i = 0; i < 3000; ++i) {
      if (i > 50 && i < 2999 && is_lost(random))
        ++lost;
      else
        missed.note({i * kPeriod + jitter(random)});
    }
    EXPECT_NEAR(static_cast<double>(missed.count()), static_cast<double>(lost), 0.02 * static_cast<double>(lost))
        << share;
  }
}

TEST(MissedCount, LateStampsAreNotMissed) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> late(0, 2 * kPeriod / 5);  // stamped on reception, by a busy machine
  MissedCount missed;
  for (int i = 0; i < 3000; ++i) missed.note({i * kPeriod + late(random)});
  EXPECT_EQ(missed.count(), 0U);
}

// HKU's keyframes (real): 0.2 to 0.4 s apart, 126 of 314 were said to be missed.
TEST(MissedCount, KeyframesAtNoFixedRateAreNotMissed) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> scans(2, 4);
  MissedCount missed;
  std::int64_t stamp = 0;
  for (int i = 0; i < 300; ++i) missed.note({stamp += scans(random) * 100'000'000});
  EXPECT_LE(missed.count(), 15U);
}

TEST(MissedCount, PausesAndClocksThatGoBackAreNone) {
  MissedCount missed;
  for (int i = 0; i < 20; ++i) missed.note({i * kPeriod});
  missed.note({1000 * kPeriod});
  missed.note({3 * kPeriod});
  missed.note({3 * kPeriod});
  for (int i = 4; i < 20; ++i) missed.note({i * kPeriod});
  EXPECT_EQ(missed.count(), 0U);
  missed.note({22 * kPeriod});
  EXPECT_EQ(missed.count(), 2U);
}

}  // namespace missed_count_test
}  // namespace tutti::intake
