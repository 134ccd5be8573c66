// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/smooth_map.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Eigenvalues>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::program {
namespace smooth_map_test {

Pose3 small(Rng& rng, double metres, double degrees) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi(i) = rng.normal(i < 3 ? metres : degrees * kRadPerDeg);
  return retract({}, xi);
}

/// A robot that drives, far from where its odometry begins, and whose map is corrected now and then.
RC_GTEST_PROP(SmoothMap, MovesNoFasterThanItMayOrSaysSo, ()) {
  const FeedSettings settings;
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const double correction_m = *rc::gen::element(0.05, 0.3, 2.0);
  SmoothMap map(settings, {});
  StampedPose sample{{1'000'000'000}, small(rng, 300.0, 90.0)};
  Pose3 target, shown;
  int jumps = 0;
  for (int i = 0; i < 300; ++i) {
    if (rng.bernoulli(0.05))  // about where the robot is
      target = target * sample.pose * small(rng, correction_m, 3.0 * correction_m) * sample.pose.inverse();
    const double dt_s = i == 0 ? 0.0 : rng.uniform(0.005, 0.3);
    sample = {sample.stamp + dt_s, sample.pose * small(rng, 0.05, 1.0)};
    const Matrix6d covariance = 1e-4 * Matrix6d::Identity();
    const auto answer = map.step(sample, target, covariance);
    const Vector6d moved = local(shown * sample.pose, answer.T_map_odom * sample.pose);
    const Vector6d left = local(answer.T_map_odom * sample.pose, target * sample.pose);
    if (answer.jump) {
      ++jumps;
      RC_ASSERT(answer.jump->from == shown);
      RC_ASSERT(answer.jump->to == answer.T_map_odom);
      RC_ASSERT(answer.T_map_odom == target);
      RC_ASSERT(std::abs(moved.head<3>().norm() - answer.jump->translation_m) < 1e-9);
      RC_ASSERT(answer.jump->translation_m > settings.jump_m ||
                answer.jump->rotation_rad > settings.jump_deg * kRadPerDeg);
    } else {
      RC_ASSERT(moved.head<3>().norm() <= settings.blend_m_per_s * dt_s + 1e-9);
      RC_ASSERT(moved.tail<3>().norm() <= settings.blend_deg_per_s * kRadPerDeg * dt_s + 1e-9);
    }
    // Back at the body the covariance is what it was, and what is left to go.
    const Matrix6d back = adjoint(sample.pose.inverse());
    const Matrix6d at_body = back * answer.covariance * back.transpose();
    RC_ASSERT((at_body - covariance - left * left.transpose()).norm() < 1e-6 * (1.0 + at_body.norm()));
    shown = answer.T_map_odom;
  }
  RC_ASSERT((jumps > 0) == (correction_m > 1.0) || correction_m == 0.3);
}

TEST(SmoothMap, ArrivesInTheTimeThatTheDistanceTakes) {
  const FeedSettings settings{.blend_m_per_s = 0.2};
  SmoothMap map(settings, {});
  Pose3 target;
  target.translation.x() = 0.5;
  StampedPose sample{{0}, {}};
  for (int i = 0; i <= 24; ++i) map.step({sample.stamp + 0.1 * i, {}}, target, Matrix6d::Zero());
  EXPECT_NEAR(map.T_map_odom().translation.x(), 0.48, 1e-9);
  for (int i = 25; i <= 26; ++i) map.step({sample.stamp + 0.1 * i, {}}, target, Matrix6d::Zero());
  EXPECT_EQ(map.T_map_odom(), target);
}

}  // namespace smooth_map_test
}  // namespace tutti::program
