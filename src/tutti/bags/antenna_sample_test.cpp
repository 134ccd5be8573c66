// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/antenna_sample.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/bags/bag_writer.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::bags {
namespace antenna_sample_test {

RosNavSatFix message() {
  RosNavSatFix out = to_ros({{5}, "/gnss"}, {46.5, -7.9, 612.0});
  out.position_covariance = {4.0, 1.0, 0.0, 1.0, 3.0, 0.5, 0.0, 0.5, 9.0};
  out.position_covariance_type = 3;
  return out;
}

/// Through the very bytes that a receiver's driver publishes.
Result<std::optional<AntennaSample>> heard(const RosNavSatFix& message) {
  return read_antenna_sample("/gnss/fix", kFixType, encode(message), RosEncoding::cdr);
}
const PositionFix& fix_in(const Result<std::optional<AntennaSample>>& sample) {
  return std::get<PositionFix>((*sample)->measured);
}

TEST(RosFix, IsWhatTheReceiverSays) {
  const auto fix = heard(message());
  ASSERT_TRUE(fix && *fix);
  EXPECT_EQ(fix_in(fix).stamp.ns, 5);
  EXPECT_EQ(fix_in(fix).antenna, (Geodetic{46.5, -7.9, 612.0}));
  EXPECT_EQ(fix_in(fix).covariance(0, 1), 1.0);
  EXPECT_EQ(fix_in(fix).covariance(2, 2), 9.0);
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
    EXPECT_EQ(fix_in(fix).covariance, unknown_fix_covariance());
  }
}

TEST(RosFix, WithoutAnAltitudeItCountsInThePlane) {
  RosNavSatFix flat = message();
  flat.altitude_m = flat.position_covariance[8] = std::numeric_limits<double>::quiet_NaN();
  const auto fix = heard(flat);
  ASSERT_TRUE(fix && *fix);
  EXPECT_TRUE((*fix)->is_flat);
  EXPECT_TRUE((*fix)->is_stated);
  EXPECT_EQ(fix_in(fix).antenna, (Geodetic{46.5, -7.9, 0.0}));
  EXPECT_EQ(fix_in(fix).covariance(0, 1), 1.0);
  EXPECT_EQ(fix_in(fix).covariance(1, 2), 0.0);
  EXPECT_EQ(fix_in(fix).covariance(2, 2), kUnknownAltitude_m * kUnknownAltitude_m);
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

TEST(RosRange, ATopicSaysToWhichRobotItIs) {
  EXPECT_EQ(ranged_robot("/alpha/range_to/bravo"), "bravo");
  EXPECT_EQ(ranged_robot("range_to/bravo"), "bravo");
  for (const char* other : {"/alpha/sonar", "/alpha/range_to", "/alpha/range_to/", "/alpha/range_to/bravo/raw",
                            "/alpha/my_range_to/bravo", ""})
    EXPECT_EQ(ranged_robot(other), "") << other;
}

TEST(RosRange, IsWhatItsSenderStates) {
  const auto range = to_range({{{5}, "uwb"}, 0.1F, 50.0F, 12.5F, 0.04F}, "bravo");
  ASSERT_TRUE(range && *range);
  EXPECT_EQ((*range)->stamp(), Timestamp{5});
  EXPECT_EQ((*range)->range()->distance_m, 12.5);
  EXPECT_NEAR((*range)->range()->sigma_m, 0.2, 1e-6);
  EXPECT_EQ((*range)->range()->name, "bravo");
  EXPECT_EQ((*range)->frame, "uwb");
  EXPECT_EQ(to_range({{{5}, ""}, 0.0F, 0.0F, 12.5F, 0.0F}, "bravo").value()->range()->sigma_m, 0.0);
}

/// ROS 2 before Jazzy, and ROS 1, have no variance.
TEST(RosRange, OfEitherDefinitionIsRead) {
  using test::range;
  const std::string whole = range(12.5F, 0.04F), before = whole.substr(0, whole.size() - 4);
  EXPECT_EQ(decode_range(whole).value().variance, 0.04F);
  EXPECT_EQ(decode_range(before).value().variance, 0.0F);
  EXPECT_EQ(decode_range(before).value().range_m, 12.5F);
  for (std::size_t size = 0; size < before.size(); ++size)
    EXPECT_FALSE(decode_range(whole.substr(0, size)).has_value()) << size;
  EXPECT_FALSE(decode_range(whole + std::string(4, '\0')).has_value());
}

TEST(RosRange, BeyondItsLimitsThereIsNone) {
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, 60.0F, 0.0F}, "bravo").value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, std::numeric_limits<float>::infinity(), 0.0F}, "bravo").value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, std::numeric_limits<float>::quiet_NaN(), 0.0F}, "bravo").has_value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.0F, 0.0F, -1.0F, 0.0F}, "bravo").has_value());
}

TEST(AntennaSample, IsReadAsItsTypeAndTopicSay) {
  const std::string bytes = test::range(12.5F, 0.04F);
  EXPECT_EQ(read_antenna_sample("/a/range_to/b", kRangeType, bytes, RosEncoding::cdr).value()->range()->name, "b");
  EXPECT_FALSE(read_antenna_sample("/a/sonar", kRangeType, "to a wall", RosEncoding::cdr).value());
  EXPECT_FALSE(read_antenna_sample("/a/range_to/b", kRangeType, "", RosEncoding::cdr));
  EXPECT_FALSE(read_antenna_sample("/a/fix", kFixType, bytes, RosEncoding::cdr));
}

TEST(AntennaSample, AnAntennaIsWhereTheMissionOrTransformsSayOrAtTheOrigin) {
  const Pose3 T_body_antenna{Eigen::Quaterniond::Identity(), {0.5, 0.1, 1.2}};
  const Result<Pose3> unknown = fail(ErrorCode::invalid, "no transform from 'gnss'");
  const auto fix = heard(message()).value(), range = to_range({{{5}, "uwb"}, 0.0F, 0.0F, 12.5F, 0.0F}, "b").value();
  const auto placed = [](AntennaSample sample, const std::optional<Eigen::Vector3d>& receiver,
                         const Result<Pose3>& pose, const std::string& expected) {
    EXPECT_EQ(place_antenna(sample, receiver, pose), expected);
    return std::visit([](const auto& of) { return of.p_body_antenna; }, sample.measured);
  };
  const std::string guess = "an antenna that is taken to be at the body's origin: no transform from 'gnss'",
                    by_transform = "an antenna at [0.50 0.10 1.20] m of the body";
  const Eigen::Vector3d receiver(1, 2, 3);
  EXPECT_EQ(placed(*fix, {}, T_body_antenna, by_transform), T_body_antenna.translation);
  EXPECT_EQ(placed(*fix, receiver, T_body_antenna, "an antenna at [1.00 2.00 3.00] m of the body"), receiver);
  EXPECT_EQ(placed(*fix, {}, unknown, guess + "; a mission file's robots[].antenna_m may say where it is"),
            Eigen::Vector3d::Zero());
  EXPECT_EQ(placed(*range, receiver, T_body_antenna, by_transform), T_body_antenna.translation) << "no receiver's";
  EXPECT_EQ(placed(*range, receiver, unknown, guess), Eigen::Vector3d::Zero());
  AntennaSample far = *fix;
  EXPECT_NE(place_antenna(far, Eigen::Vector3d(0, 0, 800), unknown).find("800.0 m from the body's origin"),
            std::string::npos);
}

}  // namespace antenna_sample_test
}  // namespace tutti::bags
