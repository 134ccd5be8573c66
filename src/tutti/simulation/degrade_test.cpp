// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/degrade.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {
namespace degrade_test {

Trajectory any_odometry() {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Trajectory odometry{{{1'000'000'000}, random_frame(rng, 30.0, 10.0)}};
  const auto size = *rc::gen::inRange<std::size_t>(1, 60);
  while (odometry.size() < size) {
    Vector6d step;
    for (double& s : step) s = rng.normal(0.2);
    odometry.push_back({odometry.back().stamp + rng.uniform(0.05, 0.5), retract(odometry.back().pose, step)});
  }
  return odometry;
}

double length(const Trajectory& trajectory) {
  double sum = 0.0;
  for (std::size_t k = 1; k < trajectory.size(); ++k)
    sum += (trajectory[k].pose.translation - trajectory[k - 1].pose.translation).norm();
  return sum;
}

double inclination(const Pose3& pose) { return (pose.rotation.conjugate() * Eigen::Vector3d::UnitZ()).z(); }

RC_GTEST_PROP(DegradeOdometry, NothingAskedNothingChanged, ()) {
  const Trajectory odometry = any_odometry();
  const Trajectory degraded = degrade_odometry(odometry, {});
  RC_ASSERT(degraded.size() == odometry.size());
  for (std::size_t k = 0; k < odometry.size(); ++k) RC_ASSERT(local(odometry[k].pose, degraded[k].pose).norm() < 1e-12);
}

RC_GTEST_PROP(DegradeOdometry, ScalesTheLengthAndTurnsByTheDistance, ()) {
  const Trajectory odometry = any_odometry();
  const DegradeConfig config{.yaw_deg_per_m = *rc::gen::element(-0.5, 0.3, 2.0),
                             .scale_percent = *rc::gen::element(-1.0, 0.0, 0.3)};
  const Trajectory degraded = degrade_odometry(odometry, config);
  RC_ASSERT(degraded.front() == odometry.front());
  RC_ASSERT(std::abs(length(degraded) - (1.0 + 0.01 * config.scale_percent) * length(odometry)) < 1e-9);
  double travelled = 0.0;
  for (std::size_t k = 1; k < odometry.size(); ++k) {
    travelled += (odometry[k].pose.translation - odometry[k - 1].pose.translation).norm();
    const Eigen::Vector3d turn = so3_log(degraded[k].pose.rotation * odometry[k].pose.rotation.conjugate());
    RC_ASSERT((turn - Eigen::Vector3d(0, 0, kRadPerDeg * config.yaw_deg_per_m * travelled)).norm() < 1e-9);
    RC_ASSERT(std::abs(inclination(degraded[k].pose) - inclination(odometry[k].pose)) < 1e-12);
    RC_ASSERT(degraded[k].stamp == odometry[k].stamp);
  }
}

RC_GTEST_PROP(DegradeOdometry, OppositeSignsUndoEachOther, ()) {
  const Trajectory odometry = any_odometry();
  const Trajectory there = degrade_odometry(odometry, {.yaw_deg_per_m = 0.7});
  const Trajectory back = degrade_odometry(there, {.yaw_deg_per_m = -0.7});
  for (std::size_t k = 0; k < odometry.size(); ++k) RC_ASSERT(local(odometry[k].pose, back[k].pose).norm() < 1e-9);
}

RC_GTEST_PROP(RandomFrame, StaysWithinTiltAndShift, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Pose3 frame = random_frame(rng, 3.0, 50.0);
  RC_ASSERT(is_valid(frame, 1e-9));
  RC_ASSERT(inclination(frame) >= std::cos(3.0 * kRadPerDeg) - 1e-12);
  RC_ASSERT(frame.translation.cwiseAbs().maxCoeff() <= 50.0);
}

TEST(RandomFrame, DrawsEveryYaw) {
  Rng rng(1);
  int quadrants[4] = {};
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d x = random_frame(rng, 3.0, 1.0).rotation * Eigen::Vector3d::UnitX();
    ++quadrants[2 * static_cast<int>(x.x() > 0.0) + static_cast<int>(x.y() > 0.0)];
  }
  for (const int count : quadrants) EXPECT_NEAR(count, 100, 35);
}

RC_GTEST_PROP(MoveFrame, KeepsIncrements, ()) {
  const Trajectory odometry = any_odometry();
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Trajectory moved = move_frame(odometry, random_frame(rng, 3.0, 50.0));
  for (std::size_t k = 1; k < odometry.size(); ++k) {
    const Pose3 before = odometry[k - 1].pose.inverse() * odometry[k].pose;
    const Pose3 after = moved[k - 1].pose.inverse() * moved[k].pose;
    RC_ASSERT(local(before, after).norm() < 1e-9);
  }
}

}  // namespace degrade_test
}  // namespace tutti::simulation
