// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/sensor_clock.hpp"

#include <gtest/gtest.h>

namespace tutti::bags {
namespace sensor_clock_test {

constexpr Timestamp kNow{1'700'000'000'000'000'000};

TEST(SensorClock, WhatIsFarFromOdometryIsRefusedWithTheNumberThatAligns) {
  EXPECT_TRUE(check_clock(kNow, std::nullopt));
  EXPECT_TRUE(check_clock(kNow + 9.9, kNow));
  EXPECT_TRUE(check_clock(kNow, kNow + 9.9));
  EXPECT_EQ(
      check_clock(kNow + 36.9, kNow, "offset_s").error().message,
      "stamp 1700000036900000000 ns is 36.9 s from odometry's newest, 1700000000000000000 ns: are they by another "
      "clock? (as TAI is from UTC; to align them: offset_s=-37)");
  EXPECT_TRUE(check_clock(kNow - 7200.0, kNow, "offset_s").error().message.ends_with("offset_s=7200)"));
  EXPECT_TRUE(check_clock(kNow + 12.5, kNow, "offset_s").error().message.ends_with("offset_s=-12.5)"));
  EXPECT_TRUE(check_clock(kNow + 12.5, kNow).error().message.ends_with("are they by another clock?"));
  EXPECT_TRUE(check_clock({}, kNow, "offset_s").error().message.ends_with("does not fill header.stamp"));
}

TEST(SensorClock, ASmallerDifferenceIsDoubtedOnceByItsMedian) {
  SensorClock clock("offset_s");
  for (int i = 0; i < 30; ++i) {
    EXPECT_TRUE(clock.check(kNow + i + (i == 5 ? 9.0 : -2.1), kNow + i));
    if (i < 9) {
      EXPECT_EQ(clock.take_doubt(), "");
    }
  }
  EXPECT_EQ(clock.take_doubt(),
            "when they arrive, stamps are 2.1 s behind odometry's newest (median of 30, -2.1 to 9.0 s): another clock, "
            "or odometry that comes late (to align them: offset_s=2)");
  EXPECT_EQ(clock.take_doubt(), "");
  SensorClock good("offset_s");
  for (int i = 0; i < 30; ++i) EXPECT_TRUE(good.check(kNow + i + (i == 5 ? 9.0 : -0.2), kNow + i));
  EXPECT_EQ(good.take_doubt(), "");
}

TEST(SensorClock, OdometryThatIsNewestIsThatOfTheLogTime) {
  const std::vector<Arrival> arrivals{{kNow + 1.0, kNow + 51.0}, {kNow + 3.0, kNow + 53.0}, {kNow + 2.0, kNow + 54.0}};
  const OdometryArrivals odometry(arrivals);
  EXPECT_FALSE(odometry.newest_at(kNow + 50.0));
  EXPECT_EQ(odometry.newest_at(kNow + 52.0), kNow + 1.0);
  EXPECT_EQ(odometry.newest_at(kNow + 60.0), kNow + 3.0);
  const std::vector<Arrival> at_once{{kNow, kNow}, {kNow + 9.0, kNow}};
  EXPECT_FALSE(OdometryArrivals(at_once).newest_at(kNow + 5.0));
}

}  // namespace sensor_clock_test
}  // namespace tutti::bags
