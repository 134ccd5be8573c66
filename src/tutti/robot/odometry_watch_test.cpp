// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/odometry_watch.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace odometry_watch_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};

Pose3 ahead(double x_m, double yaw_rad = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), {x_m, 0.0, 0.0}};
}

/// How many jumps are reported when odometry at this speed and rate is elsewhere by `jump` from some time on.
int jumps(double speed_mps, double rate_hz, const Pose3& jump, double seconds = 20.0) {
  OdometryWatch watch;
  int reported = 0;
  const int samples = static_cast<int>(seconds * rate_hz);
  for (int i = 0; i < samples; ++i) {
    const double t = i / rate_hz;
    const Pose3 T = ahead(speed_mps * t);
    if (watch.take({kStart + t, i < samples / 2 ? T : jump * T}).jump) ++reported;
  }
  return reported;
}

TEST(OdometryWatch, FindsWhatNoBodyDoes) {
  for (const double rate_hz : {5.0, 10.0, 200.0})
    for (const double jump_m : {500.0, -500.0}) EXPECT_EQ(jumps(1.0, rate_hz, ahead(jump_m)), 1) << rate_hz;
  for (const double rate_hz : {10.0, 200.0}) {
    EXPECT_EQ(jumps(1.0, rate_hz, ahead(5.0)), 1) << rate_hz;
    EXPECT_EQ(jumps(0.0, rate_hz, ahead(5.0)), 1) << rate_hz;
    EXPECT_EQ(jumps(1.0, rate_hz, ahead(0.0, 2.0)), 1) << rate_hz;
    EXPECT_EQ(jumps(40.0, rate_hz, ahead(50.0)), 1) << rate_hz;
    EXPECT_EQ(jumps(1.0, rate_hz, ahead(0.5)), 0) << rate_hz;  // a front end that puts itself right
  }
  EXPECT_EQ(jumps(40.0, 200.0, ahead(5.0)), 1);
}

TEST(OdometryWatch, LetsACarDriveFromItsFirstSampleOnAndFromRest) {
  for (const double rate_hz : {0.5, 1.0, 10.0, 200.0, 1000.0}) EXPECT_EQ(jumps(40.0, rate_hz, {}), 0) << rate_hz;
  for (const double rate_hz : {1.0, 10.0, 200.0}) {
    OdometryWatch watch;
    for (int i = 0; i < 60.0 * rate_hz; ++i) {
      const double t = i / rate_hz, moving = std::max(0.0, t - 30.0);
      EXPECT_FALSE(watch
                       .take({kStart + t, ahead(0.5 * 9.0 * std::min(moving, 4.5) * std::min(moving, 4.5) +
                                                40.5 * std::max(0.0, moving - 4.5))})
                       .jump)
          << rate_hz << " Hz, " << t << " s";
    }
  }
}

TEST(OdometryWatch, LetsAGapInTheDataBe) {
  for (const double speed_mps : {1.0, 15.0, 40.0})
    for (const double gap_s : {1.0, 10.0, 600.0}) {
      OdometryWatch watch;
      int reported = 0;
      for (int i = 0; i < 200; ++i) {
        const double t = 0.1 * i + (i < 100 ? 0.0 : gap_s);
        if (watch.take({kStart + t, ahead(speed_mps * t, 0.3 * t)}).jump) ++reported;
      }
      EXPECT_EQ(reported, 0) << speed_mps << " m/s, " << gap_s << " s";
    }
  // From rest: during the gap a car has started.
  OdometryWatch watch;
  for (int i = 0; i < 100; ++i) watch.take({kStart + 0.1 * i, ahead(0.0)});
  EXPECT_FALSE(watch.take({kStart + 15.0, ahead(60.0)}).jump);
}

TEST(OdometryWatch, NoiseAtAHighRateIsNoSpeed) {
  OdometryWatch watch;
  Rng rng(1);
  int reported = 0;
  for (int i = 0; i < 20'000; ++i) {
    Vector6d noise;
    for (double& x : noise) x = 0.01 * rng.normal();
    if (watch.take({kStart + 0.001 * i, retract(ahead(0.001 * i), noise)}).jump) ++reported;
  }
  EXPECT_EQ(reported, 0);
  EXPECT_TRUE(watch.take({kStart + 20.0, ahead(25.0)}).jump.has_value());
}

TEST(OdometryWatch, SaysHowLargeTheJumpWas) {
  OdometryWatch watch;
  watch.take({kStart, ahead(0.0)});
  watch.take({kStart + 0.1, ahead(0.1)});
  const auto step = watch.take({kStart + 0.2, ahead(500.1, 0.5)});
  ASSERT_TRUE(step.jump.has_value());
  EXPECT_EQ(to_string(*step.jump),
            "odometry jumps by 500.0 m and 28.6 degrees within 0.100 s at 1700000000200000000 ns");
  EXPECT_EQ(step.T_odom_body, ahead(0.1));  // to the bit
}

TEST(OdometryWatch, AStampThatDoesNotFollowChangesNothing) {
  OdometryWatch watch;
  watch.take({kStart, ahead(0.0)});
  watch.take({kStart + 0.1, ahead(0.1)});
  const OdometryWatch::State before = watch.state();
  for (const double t : {0.1, 0.05, -1e9}) EXPECT_FALSE(watch.take({kStart + t, ahead(700.0)}).jump);
  EXPECT_EQ(watch.state(), before);
}

/// Jumps or not, what comes out moves as the robot does, and states how the frame of the front end lies in it.
RC_GTEST_PROP(OdometryWatch, WhatComesOutNeverJumps, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  OdometryWatch watch;
  Pose3 truth, T_fed_odom, last;
  int made = 0, reported = 0;
  for (int i = 0; i < 400; ++i) {
    Vector6d motion, elsewhere;
    for (double& x : motion) x = 0.02 * rng.normal();
    motion[0] += 0.1;
    truth = retract(truth, motion);
    if (i > 10 && rng.bernoulli(0.02)) {
      for (double& x : elsewhere) x = rng.normal();
      elsewhere.head<3>() = 30.0 * elsewhere.head<3>().normalized();
      T_fed_odom = T_fed_odom * retract(Pose3{}, elsewhere);
      ++made;
    }
    const Pose3 fed = T_fed_odom * truth;
    const auto step = watch.take({kStart + 0.1 * i, fed});
    if (step.jump) ++reported;
    if (made == 0) RC_ASSERT(step.T_odom_body == fed);
    if (i > 0) RC_ASSERT((step.T_odom_body.translation - last.translation).norm() < 0.5);
    RC_ASSERT(local(watch.T_odom_fed() * fed, step.T_odom_body).norm() < 1e-6);
    RC_ASSERT(watch.T_odom_body() == step.T_odom_body);
    last = step.T_odom_body;
    if (rng.bernoulli(0.1)) watch = OdometryWatch(watch.state());
  }
  // A jump may by chance lead where the robot is.
  RC_ASSERT(reported <= made);
  RC_ASSERT(2 * reported >= made);
}

}  // namespace odometry_watch_test
}  // namespace tutti::robot
