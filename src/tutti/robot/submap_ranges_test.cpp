// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {
namespace submap_ranges_test {

Timestamp at(double seconds) { return Timestamp{0} + seconds; }

RobotRange range_at(double t, std::uint32_t to = 1) {
  return {.stamp = at(t), .to = RobotId{to}, .distance_m = 10.0 + t, .sigma_m = 0.1, .p_body_antenna = {1, 0, 0}};
}

std::vector<Submap> drive(SubmapBuilder& builder, double ranges_hz, double late_s = 0.0, int robots = 1) {
  std::vector<Submap> out;
  int sent = 0;
  for (int i = 0; i <= 400; ++i) {
    const double t = 0.1 * i;
    EXPECT_TRUE(
        builder.add(OdometryStep{at(t), {Eigen::Quaterniond::Identity(), {t, 0, 0}}, Matrix6d::Identity() * 1e-6})
            .has_value());
    for (; sent / ranges_hz + late_s <= t; ++sent)
      for (int r = 1; r <= robots; ++r)
        EXPECT_TRUE(builder.add(range_at(sent / ranges_hz, static_cast<std::uint32_t>(r))).has_value());
    while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  }
  builder.finish();
  while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  return out;
}

std::size_t ranges_of(const std::vector<Submap>& submaps) {
  std::size_t out = 0;
  for (const Submap& submap : submaps) out += submap.ranges.size();
  return out;
}

TEST(SubmapRanges, EachIsInTheSubmapThatEndsAfterIt) {
  SubmapBuilder builder(RobotId{3}, {});
  const std::vector<Submap> submaps = drive(builder, 1.0);
  EXPECT_EQ(ranges_of(submaps), 40U);  // the one at the end is after the last keyframe
  for (const Submap& submap : submaps)
    for (const RobotRange& range : submap.ranges) {
      EXPECT_GE(range.stamp, submap.keyframes.front().stamp);
      EXPECT_LE(range.stamp, submap.keyframes.back().stamp);
      EXPECT_NEAR(range.distance_m, 10.0 + (range.stamp - at(0)), 1e-9);
    }
}

TEST(SubmapRanges, OneASecondOfEachRobotIsKept) {
  SubmapBuilder one(RobotId{9}, {}), three(RobotId{9}, {});
  const std::size_t kept = ranges_of(drive(one, 10.0));
  EXPECT_GE(kept, 38U);
  EXPECT_LE(kept, 46U);  // the first of a submap does not know the one before
  EXPECT_EQ(ranges_of(drive(three, 10.0, 0.0, 3)), 3 * kept);
}

TEST(SubmapRanges, LateOnesAreTaken) {
  SubmapBuilder builder(RobotId{3}, {});
  EXPECT_EQ(ranges_of(drive(builder, 1.0, 0.5)), 40U);
}

TEST(SubmapRanges, ImpossibleOnesAreRefusedWithWhatIsWrong) {
  SubmapBuilder builder(RobotId{3}, {});
  EXPECT_TRUE(builder.add(OdometryStep{at(0), {}, Matrix6d::Identity() * 1e-6}).has_value());
  const auto why = [&](const RobotRange& range) {
    const Status ok = builder.add(range);
    return ok ? std::string() : ok.error().message;
  };
  RobotRange bad = range_at(0);
  bad.distance_m = std::nan("");
  EXPECT_EQ(why(bad), "robot 3: range at 0 ns: distance nan m, expected 0 to 100000 m");
  bad.distance_m = -1.0;
  EXPECT_EQ(why(bad), "robot 3: range at 0 ns: distance -1 m, expected 0 to 100000 m");
  bad = range_at(0);
  bad.sigma_m = -0.1;
  EXPECT_NE(why(bad).find("sigma -0.1 m"), std::string::npos);
  bad = range_at(0);
  bad.p_body_antenna.x() = std::numeric_limits<double>::infinity();
  EXPECT_NE(why(bad).find("antenna inf m from the body"), std::string::npos);
  EXPECT_NE(why(range_at(0, 3)).find("to robot 3 itself"), std::string::npos);
  EXPECT_NE(why(range_at(50)).find("no odometry within"), std::string::npos);
  EXPECT_EQ(why(range_at(0)), "");
}

}  // namespace submap_ranges_test
}  // namespace tutti::robot
