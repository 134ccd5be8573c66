// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_fix.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tutti/bags/ros_encode.hpp"

namespace tutti::bags {
namespace ros_fix_test {

RosNavSatFix message() {
  RosNavSatFix out = to_ros({{5}, "/gnss"}, {46.5, -7.9, 612.0});
  out.position_covariance = {4.0, 1.0, 0.0, 1.0, 3.0, 0.5, 0.0, 0.5, 9.0};
  out.position_covariance_type = 3;
  return out;
}

/// Through the very bytes that a receiver's driver publishes.
Result<std::optional<ReceivedFix>> heard(const RosNavSatFix& message) {
  return to_fix(decode_nav_sat_fix(encode(message)).value());
}

TEST(RosFix, IsWhatTheReceiverSays) {
  const auto fix = heard(message());
  ASSERT_TRUE(fix && *fix);
  EXPECT_EQ((*fix)->fix.stamp.ns, 5);
  EXPECT_EQ((*fix)->fix.antenna, (Geodetic{46.5, -7.9, 612.0}));
  EXPECT_EQ((*fix)->fix.covariance(0, 1), 1.0);
  EXPECT_EQ((*fix)->fix.covariance(2, 2), 9.0);
  EXPECT_EQ((*fix)->frame, "gnss");
  EXPECT_TRUE((*fix)->is_stated);
}

TEST(RosFix, OfUnknownSurenessIsTakenAsUnsure) {
  for (int how = 0; how < 3; ++how) {
    RosNavSatFix unsure = message();
    if (how == 0) unsure.position_covariance_type = 0;
    if (how == 1) unsure.position_covariance = {};
    if (how == 2) unsure.position_covariance[0] = -1.0;
    const auto fix = heard(unsure);
    ASSERT_TRUE(fix && *fix) << how;
    EXPECT_FALSE((*fix)->is_stated);
    EXPECT_EQ((*fix)->fix.covariance, unknown_fix_covariance());
  }
}

TEST(RosFix, WithoutAnAltitudeItCountsInThePlane) {
  RosNavSatFix flat = message();
  flat.altitude_m = flat.position_covariance[8] = std::numeric_limits<double>::quiet_NaN();
  const auto fix = heard(flat);
  ASSERT_TRUE(fix && *fix);
  EXPECT_TRUE((*fix)->is_flat);
  EXPECT_TRUE((*fix)->is_stated);
  EXPECT_EQ((*fix)->fix.antenna, (Geodetic{46.5, -7.9, 0.0}));
  EXPECT_EQ((*fix)->fix.covariance(0, 1), 1.0);
  EXPECT_EQ((*fix)->fix.covariance(1, 2), 0.0);
  EXPECT_EQ((*fix)->fix.covariance(2, 2), kUnknownAltitude_m * kUnknownAltitude_m);
  EXPECT_FALSE(heard(message()).value()->is_flat);
}

TEST(RosFix, OfAReceiverWithoutOneIsNoneAndGarbageIsDistinguished) {
  RosNavSatFix none = message(), nowhere = message(), skewed = message(), unset = message();
  unset.latitude_deg = unset.longitude_deg = 0.0;
  EXPECT_FALSE(heard(unset).value().has_value());
  none.status = -1;
  none.latitude_deg = nowhere.latitude_deg = std::numeric_limits<double>::quiet_NaN();
  skewed.position_covariance[1] = 100.0;
  EXPECT_FALSE(heard(none).value().has_value());
  EXPECT_EQ(heard(nowhere).error().message, "latitude nan degrees, expected -90 to 90");
  EXPECT_NE(heard(skewed).error().message.find("expected a symmetric"), std::string::npos);
}

}  // namespace ros_fix_test
}  // namespace tutti::bags
