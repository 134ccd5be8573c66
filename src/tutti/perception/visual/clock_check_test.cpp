// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/clock_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/perception/visual/textured_room.hpp"

namespace tutti::visual {
namespace clock_check_test {

const auto kRoom = test::textured_room(400, Rng(1));
const Camera kCamera = test::stereo_cameras()[0];

/// Across the room, turning to and fro; or straight on.
Pose3 pose(double time_s, bool turns) {
  const double yaw_rad = turns ? 1.5 + 0.4 * std::sin(1.5 * time_s) : 1.5;
  return {so3_exp(yaw_rad * Eigen::Vector3d::UnitZ()), {1.5 + 0.25 * time_s, 2.0, 1.4}};
}

/// Of images taken `late_s` after their stamps, every 0.2 s for 16 s.
ClockCheck watched(double late_s, bool turns = true) {
  ClockCheck check(kCamera);
  Rng rng(2);
  for (int i = 0; i <= 80; ++i) {
    const double stamp_s = 1.0 + 0.2 * i;
    check.add(Timestamp{} + stamp_s, test::look(kRoom, kCamera, 0, pose(stamp_s + late_s, turns), {}, rng));
  }
  return check;
}

Trajectory odometry(bool turns = true) {
  Trajectory out;
  for (int i = 0; i <= 360; ++i) out.push_back({Timestamp{} + 0.05 * i, pose(0.05 * i, turns)});
  return out;
}

TEST(ClockCheck, FindsTheOffset) {
  for (const double late_s : {-0.2, 0.06, 0.3}) {
    const auto offset_s = watched(late_s).offset_s(odometry());
    ASSERT_TRUE(offset_s.has_value()) << late_s;
    EXPECT_NEAR(*offset_s, late_s, 0.021);
  }
}

TEST(ClockCheck, SaysNothingWhereThereIsNoneOrNothingTells) {
  EXPECT_EQ(watched(0.0).pairs(), 40U);
  EXPECT_FALSE(watched(0.0).offset_s(odometry()).has_value());
  EXPECT_FALSE(watched(0.01).offset_s(odometry()).has_value());
  EXPECT_FALSE(watched(0.2, false).offset_s(odometry(false)).has_value());  // straight on, one moment is as any other
  EXPECT_FALSE(watched(0.2).offset_s({}).has_value());
  EXPECT_FALSE(ClockCheck(kCamera).offset_s(odometry()).has_value());
}

}  // namespace clock_check_test
}  // namespace tutti::visual
