// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/track.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/random_pose.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::localise {
namespace track_test {

using tutti::test::draw;

Timestamp at(double seconds) { return Timestamp{} + seconds; }

/// The truth is drawn from what odometry states to err by and from the share of the way that it may err by anyway, so
/// the filter's errors are as large as it says (chi-square of 6 degrees of freedom; 300 runs of 20 steps).
TEST(Track, ErrsAsItSays) {
  Rng rng(3);
  constexpr int kRuns = 300;
  const double least_m = 0.01 * 0.2 + 0.002, least_rad = 0.2 * kRadPerDeg * 0.2 + 0.01 * 0.05;
  double nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Track track{.T_world_body = {Pose3(), diagonal_covariance(0.1, 0.02)}};
    Pose3 truth = retract(Pose3(), draw(rng, 0.1, 0.02)), T_odom_body;
    const Pose3 step{so3_exp({0.0, 0.0, 0.05}), {0.2, 0.0, 0.0}};
    for (int k = 1; k <= 20; ++k) {
      T_odom_body = T_odom_body * step;
      truth = retract(retract(truth * step, draw(rng, 0.005, 0.001)), draw(rng, least_m, least_rad));
      track.predict_to({at(k), T_odom_body}, diagonal_covariance(0.005, 0.001));
      if (k % 4 == 0) track.correct({retract(truth, draw(rng, 0.03, 0.01)), diagonal_covariance(0.03, 0.01)});
    }
    const Vector6d error = local(track.T_world_body.T_a_b, truth);
    nees += squared_distance(error, track.T_world_body.covariance) / kRuns;
  }
  EXPECT_NEAR(nees, 6.0, 4.0 * std::sqrt(12.0 / kRuns));
}

TEST(Track, APoseThatIsSureTakesOverAndOneThatIsNotChangesNothing) {
  const Pose3 there{so3_exp({0.0, 0.0, 0.1}), {1.0, 0.5, 0.0}};
  const Track before{.T_world_body = {Pose3(), diagonal_covariance(0.5, 0.2)}};
  Track sure = before, unsure = before;
  sure.correct({there, diagonal_covariance(1e-5, 1e-5)});
  EXPECT_LT(local(sure.T_world_body.T_a_b, there).norm(), 1e-6);
  EXPECT_LT(sure.T_world_body.covariance.norm(), 1e-8);
  unsure.correct({there, diagonal_covariance(1e5, 1e5)});
  EXPECT_LT(local(unsure.T_world_body.T_a_b, before.T_world_body.T_a_b).norm(), 1e-6);
  EXPECT_LT((unsure.T_world_body.covariance - before.T_world_body.covariance).norm(), 1e-6);
}

TEST(Track, OdometryThatStatesNoErrorsErrsByAShareOfTheWay) {
  Track track{.T_world_body = {Pose3(), Matrix6d::Zero()}, .at = {at(0), Pose3()}};
  const Pose3 far{Eigen::Quaterniond::Identity(), {10.0, 0.0, 0.0}};
  const RelativePose carried = track.carried_to(far);
  track.predict_to({at(1), far}, Matrix6d::Zero());
  EXPECT_EQ(track.T_world_body.covariance, carried.covariance);
  EXPECT_EQ(track.T_world_body.T_a_b, carried.T_a_b);
  EXPECT_EQ(track.at.stamp, at(1));
  EXPECT_NEAR(std::sqrt(carried.covariance(0, 0)), 0.102, 1e-9);
  EXPECT_NEAR(std::sqrt(carried.covariance(5, 5)), 2.0 * kRadPerDeg, 1e-9);
}

TEST(RecentOdometry, KeepsTheLastSecondsAndSumsWhatItsStepsState) {
  RecentOdometry recent;
  EXPECT_FALSE(recent.newest().has_value());
  for (int k = 0; k <= 100; ++k)
    recent.add({at(0.1 * k), {Eigen::Quaterniond::Identity(), {0.1 * k, 0.0, 0.0}}, diagonal_covariance(0.01, 0.001)});
  EXPECT_EQ(recent.newest()->stamp, at(10.0));
  EXPECT_NEAR(recent.poses().back().stamp - recent.poses().front().stamp, RecentOdometry::kKept_s, 1e-6);
  EXPECT_NEAR(recent.stated(at(9.0), at(9.5))(0, 0), 5e-4, 1e-12);  // five steps, and not that to 9.0
  EXPECT_EQ(recent.stated(at(10.0), at(10.0)), Matrix6d::Zero());
  recent.add({at(10.1), Pose3(), diagonal_covariance(1e3, 1e3)});  // whatever it states
  EXPECT_LE(recent.newest()->increment_covariance(0, 0), 1.0 + 1e-9);
}

TEST(Track, WhatIsUsualFollowsScansOfSomeSeconds) {
  Track track;
  track.learn(0.9);
  EXPECT_DOUBLE_EQ(track.usual_quality.value(), 0.9);
  track.learn(0.5);
  EXPECT_GT(*track.usual_quality, 0.8);
  for (int k = 0; k < 40; ++k) track.learn(0.5);
  EXPECT_NEAR(*track.usual_quality, 0.5, 0.02);
}

}  // namespace track_test
}  // namespace tutti::localise
