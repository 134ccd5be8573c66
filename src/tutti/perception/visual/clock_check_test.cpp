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

/// Has seen images taken `late_s` after their stamps, every 0.2 s for 16 s.
ClockCheck watched(double late_s, bool turns = true, const Camera& stated = kCamera) {
  ClockCheck check(stated);
  Rng rng(2);
  for (int i = 0; i <= 80; ++i) {
    const double stamp_s = 1.0 + 0.2 * i;
    check.add(Timestamp{} + stamp_s, test::look(kRoom, kCamera, 0, pose(stamp_s + late_s, turns), {}, rng));
  }
  return check;
}

Trajectory odometry(bool turns = true, double rate_hz = 20.0) {
  Trajectory out;
  for (int i = 0; i <= static_cast<int>(18.0 * rate_hz); ++i)
    out.push_back({Timestamp{} + i / rate_hz, pose(i / rate_hz, turns)});
  return out;
}

TEST(ClockCheck, FindsTheOffset) {
  for (const double late_s : {-0.2, -0.1, 0.1, 0.3}) {
    for (const double rate_hz : {10.0, 20.0, 200.0}) {
      const auto offset_s = watched(late_s).offset_s(odometry(true, rate_hz));
      ASSERT_TRUE(offset_s.has_value()) << late_s << " s at " << rate_hz << " Hz";
      EXPECT_NEAR(*offset_s, late_s, 0.021) << rate_hz;
    }
  }
}

TEST(ClockCheck, FindsACameraTurnedAboutItsAxis) {
  for (const int degrees : {0, 90, 180, 270}) {
    Camera stated = kCamera;  // the images are kCamera's
    stated.T_body_camera.rotation =
        stated.T_body_camera.rotation * so3_exp(-degrees * kRadPerDeg * Eigen::Vector3d::UnitZ());
    EXPECT_EQ(watched(0.0, true, stated).roll_deg(odometry()), degrees == 0 ? std::nullopt : std::optional(degrees));
  }
}

TEST(ClockCheck, SaysNothingWhereThereIsNoneOrNothingShowsIt) {
  EXPECT_EQ(watched(0.0).pairs(), 40U);
  EXPECT_FALSE(watched(0.0).offset_s(odometry()).has_value());
  EXPECT_FALSE(watched(0.01).offset_s(odometry()).has_value());
  EXPECT_FALSE(watched(0.2, false).offset_s(odometry(false)).has_value());  // straight on, one time is as any other
  EXPECT_FALSE(watched(0.2).offset_s({}).has_value());
  EXPECT_FALSE(ClockCheck(kCamera).offset_s(odometry()).has_value());
}

}  // namespace clock_check_test
}  // namespace tutti::visual
