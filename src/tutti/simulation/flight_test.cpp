// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/flight.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/hall.hpp"

namespace tutti::simulation {
namespace flight_test {

RC_GTEST_PROP(Flight, DerivativesAreThoseOfThePose, ()) {
  FlightConfig config;
  config.start_deg = *rc::gen::inRange(0, 360);
  config.tilt_deg = *rc::gen::inRange(0, 60);
  const double t = 0.001 * *rc::gen::inRange(0, 100'000), h = 1e-4;
  const Motion before = flight_motion(config, t - h), now = flight_motion(config, t),
               after = flight_motion(config, t + h);
  const Pose3 &a = before.T_world_body, &b = after.T_world_body;
  RC_ASSERT(((b.translation - a.translation) / (2 * h) - now.velocity).norm() < 1e-6);
  RC_ASSERT(((after.velocity - before.velocity) / (2 * h) - now.acceleration).norm() < 1e-6);
  RC_ASSERT((so3_log(a.rotation.conjugate() * b.rotation) / (2 * h) - now.angular_velocity).norm() < 1e-6);
}

TEST(Flight, KeepsClearOfEverythingInTheHall) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Bvh surface(make_hall({}, Rng(seed)).mesh);
    Rng rng(seed);
    for (const StampedPose& at : simulate_flight({.duration_s = 120.0, .rate_hz = 2.0}, Timestamp{0}))
      for (int i = 0; i < 20; ++i) {
        const Eigen::Vector3d ray = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
        const auto hit = surface.cast(at.pose.translation.cast<float>(), ray.cast<float>(), 100.0F);
        ASSERT_TRUE(hit.has_value()) << "outside";
        ASSERT_GT(hit->distance, 0.2F);
      }
  }
}

TEST(Flight, EveryRoundSeesThePlacesOfTheOneBefore) {
  const FlightConfig config;
  const Trajectory truth = simulate_flight({.duration_s = 80.0, .rate_hz = 10.0}, Timestamp{5});
  EXPECT_EQ(truth.size(), 801U);
  EXPECT_EQ(truth.front().stamp, Timestamp{5});
  int revisits = 0;
  for (std::size_t i = 0; i + 400 < truth.size(); ++i) {
    const Pose3 between = truth[i].pose.inverse() * truth[i + 400].pose;
    revisits += between.translation.norm() < 1.0 && rotation_angle(between) < 30.0 * kRadPerDeg ? 1 : 0;
  }
  EXPECT_GE(revisits, 300);
}

}  // namespace flight_test
}  // namespace tutti::simulation
