// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_clock.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace tutti::program {
namespace feed_clock_test {

constexpr std::int64_t kSecond = 1'000'000'000, kHour = 3600 * kSecond;
constexpr Timestamp kNow{1'700'000'000 * kSecond};

TEST(FeedClock, IsTheRobotsUnlessSetOtherwise) {
  FeedClock clock;
  ASSERT_TRUE(clock.begin(std::nullopt, std::nullopt, kNow));
  EXPECT_EQ(clock.how(), FeedClock::How::same);
  EXPECT_EQ(clock.to_robot({42}), Timestamp{42});
  EXPECT_EQ(clock.check(kNow.ns - 5, kNow), 5);  // reported, and not used
  EXPECT_EQ(clock.offset_ns(), 0);
}

TEST(FeedClock, OfThreeHoursOffIsMeasured) {
  FeedClock clock;
  ASSERT_TRUE(clock.begin(std::nullopt, kNow.ns - 3 * kHour, kNow));
  EXPECT_EQ(clock.how(), FeedClock::How::measured);
  EXPECT_EQ(clock.offset_ns(), 3 * kHour);
  EXPECT_EQ(clock.to_robot({kNow.ns - 3 * kHour + 7}), Timestamp{kNow.ns + 7});
}

TEST(FeedClock, ThatDriftsKeepsItsOffsetAndLearnsByHowMuch) {
  FeedClock clock;
  ASSERT_TRUE(clock.begin(std::nullopt, kNow.ns, kNow));
  EXPECT_FALSE(clock.drift_ppm());
  for (int s = 1; s <= 600; ++s) {  // 200 ppm fast; a message takes up to 1 ms
    const Timestamp now{kNow.ns + s * kSecond};
    const auto measured = clock.check(now.ns + s * kSecond / 5000 - s % 7 * 100'000, now);
    ASSERT_TRUE(measured);
    EXPECT_EQ(clock.offset_ns(), 0);
    EXPECT_EQ(clock.drift_ppm().has_value(), s >= 10) << s;
  }
  EXPECT_NEAR(*clock.drift_ppm(), 200.0, 2.0);
}

TEST(FeedClock, OfOneThatComesAgainIsTheSame) {
  FeedClock clock;
  ASSERT_TRUE(clock.begin(std::nullopt, kNow.ns - kHour, kNow));
  ASSERT_TRUE(clock.begin(std::nullopt, kNow.ns - kHour + kSecond - 1'000'000, kNow + 1.0));  // took 1 ms longer
  EXPECT_EQ(clock.offset_ns(), kHour);
  ASSERT_TRUE(clock.begin(std::nullopt, 5 * kSecond, kNow + 2.0));  // counts from its start
  EXPECT_EQ(clock.offset_ns(), kNow.ns - 3 * kSecond);
  ASSERT_TRUE(clock.begin(12, std::nullopt, kNow));
  EXPECT_EQ(clock.how(), FeedClock::How::declared);
  EXPECT_EQ(clock.offset_ns(), 12);
}

RC_GTEST_PROP(FeedClock, OfAnyNumbersDoesNoHarm, ()) {
  const auto number = rc::gen::oneOf(
      rc::gen::arbitrary<std::int64_t>(),
      rc::gen::element(std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()));
  FeedClock clock;
  if (*rc::gen::arbitrary<bool>())
    static_cast<void>(clock.begin(*number, std::nullopt, kNow));
  else
    static_cast<void>(clock.begin(std::nullopt, *number, kNow));
  static_cast<void>(clock.check(*number, kNow + 100.0));
  static_cast<void>(clock.drift_ppm());
  const Timestamp stamp{*number};
  if (const auto moved = clock.to_robot(stamp)) RC_ASSERT(moved->ns - clock.offset_ns() == stamp.ns);
}

}  // namespace feed_clock_test
}  // namespace tutti::program
