// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {
namespace submap_fixes_test {

Timestamp at(double seconds) { return Timestamp{0} + seconds; }

/// Round a circle of 10 m at 1 m/s.
Pose3 place(double t) {
  const double angle = 0.1 * t;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
          {10 * std::cos(angle), 10 * std::sin(angle), 0}};
}

PositionFix fix_at(double t) {
  return {.stamp = at(t), .antenna = {46.5, 7.9, 600.0 + t}, .p_body_antenna = {1.0, 0.5, 2.0}};
}

struct Drive {
  double seconds = 40.0, fixes_hz = 1.0, late_s = 0.0, jump_at_s = -1.0;
};

std::vector<Submap> drive(SubmapBuilder& builder, const Drive& how) {
  std::vector<Submap> out;
  int sent = 0;
  for (int i = 0; i <= static_cast<int>(10 * how.seconds); ++i) {
    const double t = 0.1 * i;
    EXPECT_TRUE(
        builder.add(OdometryStep{at(t), place(t), Matrix6d::Identity() * 1e-6, t == how.jump_at_s}).has_value());
    for (; sent / how.fixes_hz + how.late_s <= t; ++sent)
      EXPECT_TRUE(builder.add(fix_at(sent / how.fixes_hz)).has_value());
    while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  }
  builder.finish();
  while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  return out;
}

/// The times of a submap's fixes, which their heights encode.
std::vector<double> fix_times(const Submap& submap) {
  std::vector<double> out;
  for (const SubmapFix& fix : submap.fixes) out.push_back(fix.antenna.height_m - 600.0);
  return out;
}

TEST(SubmapFixes, AreSeenFromAKeyframeNearby) {
  SubmapBuilder builder(RobotId{3}, {});
  std::size_t fixes = 0;
  for (const Submap& submap : drive(builder, {}))
    for (const SubmapFix& fix : submap.fixes) {
      ASSERT_GE(fix.keyframe, submap.keyframes.front().index);
      ASSERT_LE(fix.keyframe, submap.keyframes.back().index);
      const Keyframe& keyframe = submap.keyframes[fix.keyframe - submap.keyframes.front().index];
      const double t = fix.antenna.height_m - 600.0;
      const Eigen::Vector3d truth = place(t) * Eigen::Vector3d(1.0, 0.5, 2.0);
      EXPECT_LT((keyframe.T_odom_body * fix.p_keyframe_antenna - truth).norm(), 1e-6);
      EXPECT_LT(std::abs(keyframe.stamp - at(t)), 0.51);
      ++fixes;
    }
  EXPECT_EQ(fixes, 40U);  // the last one comes after the last keyframe
}

TEST(SubmapFixes, EachGoesWithTheSubmapOfItsTimeOnce) {
  for (const double late_s : {0.0, 0.3, 0.9}) {
    SubmapBuilder builder(RobotId{3}, {});
    std::vector<double> all;
    for (const Submap& submap : drive(builder, {.late_s = late_s}))
      for (const double t : fix_times(submap)) {
        EXPECT_GE(at(t), submap.keyframes.front().stamp - late_s - 0.1);
        EXPECT_LE(at(t), submap.keyframes.back().stamp);
        all.push_back(t);
      }
    ASSERT_EQ(all.size(), 40U);
    EXPECT_TRUE(std::ranges::is_sorted(all));
  }
}

TEST(SubmapFixes, AFastReceiverIsThinnedAndASlowOneIsNot) {
  SubmapBuilder fast(RobotId{3}, {}), slow(RobotId{3}, {});
  std::size_t of_fast = 0, of_slow = 0;
  for (const Submap& submap : drive(fast, {.fixes_hz = 20.0})) of_fast += submap.fixes.size();
  for (const Submap& submap : drive(slow, {.fixes_hz = 0.1})) of_slow += submap.fixes.size();
  EXPECT_EQ(of_fast, 89U);  // one of nine
  EXPECT_EQ(of_slow, 4U);
}

TEST(SubmapFixes, AcrossAJumpNoneIsOnTheWrongSide) {
  SubmapBuilder builder(RobotId{3}, {});
  for (const Submap& submap : drive(builder, {.jump_at_s = 15.0}))
    for (const double t : fix_times(submap)) {
      EXPECT_GE(at(t), submap.keyframes.front().stamp);
      EXPECT_LE(at(t), submap.keyframes.back().stamp);
    }
}

TEST(SubmapFixes, RefusesWhatIsNoFix) {
  SubmapBuilder builder(RobotId{3}, {});
  EXPECT_FALSE(builder.add(fix_at(0.0)).has_value());  // no odometry yet
  ASSERT_TRUE(builder.add(OdometrySample{at(0.0), {}, Matrix6d::Identity()}).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PositionFix fix = fix_at(0.0);
  fix.antenna.latitude_deg = 91.0;
  EXPECT_EQ(builder.add(fix).error().message, "robot 3: fix at 0 ns: latitude 91 degrees, expected -90 to 90");
  for (const double bad : {nan, 0.0, -1.0, 1e30}) {
    fix = fix_at(0.0);
    fix.covariance(1, 1) = bad;
    EXPECT_FALSE(builder.add(fix).has_value());
  }
  fix = fix_at(0.0);
  fix.covariance(0, 1) = 3.0;  // not symmetric
  EXPECT_FALSE(builder.add(fix).has_value());
  fix = fix_at(0.0);
  fix.p_body_antenna.x() = nan;
  EXPECT_FALSE(builder.add(fix).has_value());
  EXPECT_FALSE(builder.add(fix_at(3600.0)).has_value());  // another clock
  EXPECT_TRUE(builder.state().waiting_fixes.empty() && builder.state().fixes.empty());
}

}  // namespace submap_fixes_test
}  // namespace tutti::robot
