// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/compare_trajectories.hpp"

#include <gtest/gtest.h>

#include "support/random_pose.hpp"
#include "support/shared_data.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace compare_trajectories_test {

/// Ten poses a second at 1 m/s on a slowly winding trajectory.
Trajectory winding(double duration_s) {
  Trajectory out;
  Pose3 pose;
  for (int i = 0; i <= static_cast<int>(10.0 * duration_s); ++i) {
    out.push_back({Timestamp{5'000'000'000} + 0.1 * i, pose});
    pose = pose * Pose3{so3_exp({0.0, 0.0, 0.01 * std::sin(0.02 * i)}), {0.1, 0.0, 0.0}};
  }
  return out;
}

/// The same motions, but for `error` on top of the motion that ends at pose `at`; then moved rigidly.
Trajectory broken(const Trajectory& truth, std::size_t at, const Pose3& error, const Pose3& T) {
  Trajectory out{{truth.front().stamp, T * truth.front().pose}};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    Pose3 step = truth[i - 1].pose.inverse() * truth[i].pose;
    if (i == at) step = step * error;
    out.push_back({truth[i].stamp, out.back().pose * step});
  }
  return out;
}

double seconds_after_start(const Trajectory& truth, Timestamp stamp) { return stamp - truth.front().stamp; }

TEST(CompareTrajectories, RigidMotionsAndNoiseWithinTheToleranceAgree) {
  const Trajectory truth = winding(120.0);
  Rng rng(3);
  Trajectory b = broken(truth, 0, {}, test::random_pose(rng));
  for (auto& p : b) p.pose.translation += test::random_vector(rng, 0.003);
  const auto c = compare_trajectories({"", truth, {}}, {"x", b, {}}, {});
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(c->name, "x");
  EXPECT_EQ(c->paired, truth.size());
  EXPECT_NEAR(c->length_m, 120.0, 0.1);
  EXPECT_LT(c->before.rmse_m, 0.01);
  EXPECT_FALSE(c->explanation.disagrees());
  EXPECT_TRUE(c->explanation.origins.empty());
  EXPECT_TRUE(c->constraints.empty());
  EXPECT_EQ(c->discontinuity.translation_m, 0.0);
}

TEST(CompareTrajectories, FindsAFailureWhereItIsAndFixesIt) {
  const Trajectory truth = winding(120.0);
  Rng rng(4);
  const Trajectory b = broken(truth, 700, {so3_exp({0.0, 0.0, 0.3}), {1.0, 0.5, 0.0}}, test::random_pose(rng));
  const auto c = compare_trajectories({"", truth, {}}, {"", b, {}}, {});
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_TRUE(c->explanation.disagrees());
  ASSERT_EQ(c->explanation.origins.size(), 1U);
  const auto& origin = c->explanation.origins[0];
  EXPECT_TRUE(origin.alert);
  EXPECT_LE(seconds_after_start(truth, origin.from), 70.0);
  EXPECT_GE(seconds_after_start(truth, origin.until), 69.9);
  EXPECT_LT(origin.until - origin.from, 6.0);
  EXPECT_NEAR(origin.translation_m, 1.118, 0.02 + 0.3 * origin.length_m);  // the turn swings what follows
  EXPECT_NEAR(origin.rotation_rad, 0.3, 0.05);
  ASSERT_FALSE(c->constraints.empty());
  EXPECT_LE(c->constraints.size(), 6U);
  EXPECT_GT(c->before.rmse_m, 1.0);
  EXPECT_LT(c->after.rmse_m, 0.05);
  for (std::size_t i = 0; i < c->judge.size(); ++i) EXPECT_EQ(c->judge[i].stamp, c->judged[i].stamp);
}

TEST(CompareTrajectories, ABroadToleranceForgives) {
  const Trajectory truth = winding(120.0);
  const Trajectory b = broken(truth, 700, {so3_exp({0.0, 0.0, 0.02}), {0.1, 0.0, 0.0}}, {});
  EXPECT_TRUE(compare_trajectories({"", truth, {}}, {"", b, {}}, {.tolerance_m = 0.01, .tolerance_deg = 0.1})
                  ->explanation.disagrees());
  EXPECT_FALSE(compare_trajectories({"", truth, {}}, {"", b, {}}, {.tolerance_m = 2.0, .tolerance_deg = 20.0})
                   ->explanation.disagrees());
}

TEST(CompareTrajectories, BsOwnCovarianceDecidesWhatIsAFailure) {
  const Trajectory truth = winding(60.0);
  const Trajectory b = broken(truth, 300, {so3_exp({0.0, 0.0, 0.3}), {1.0, 0.0, 0.0}}, {});
  NamedTrajectory admitted{"", b, std::vector<Matrix6d>(b.size() - 1, 1e-6 * Matrix6d::Identity())};
  const auto silent = compare_trajectories({"", truth, {}}, admitted, {});
  ASSERT_TRUE(silent) << silent.error().message;
  ASSERT_FALSE(silent->explanation.origins.empty());
  EXPECT_TRUE(silent->explanation.origins[0].alert);
  admitted.step_covariance[299] = Matrix6d::Identity();  // it is unknown
  const auto honest = compare_trajectories({"", truth, {}}, admitted, {});
  ASSERT_TRUE(honest);
  for (const auto& origin : honest->explanation.origins) EXPECT_FALSE(origin.alert);
}

TEST(CompareTrajectories, WhatBDoesWhileAStandsStillCounts) {
  Trajectory stands = winding(20.0);
  const std::size_t begin = stands.size();
  for (int i = 1; i <= 300; ++i) stands.push_back({stands.back().stamp + 0.1, stands.back().pose});
  const Trajectory still(stands.begin() + static_cast<std::ptrdiff_t>(begin), stands.end());
  for (const Trajectory& a : {stands, still}) {
    Trajectory walks = a;
    Trajectory turns = a;
    Trajectory trembles = a;
    Rng rng(5);
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double phase =
          2.0 * M_PI * std::max(0.0, static_cast<double>(i + 300) - static_cast<double>(a.size())) / 300;
      walks[i].pose = a[i].pose * Pose3{Eigen::Quaterniond::Identity(), {1.0 - std::cos(phase), std::sin(phase), 0.0}};
      turns[i].pose = a[i].pose * Pose3{so3_exp({0.0, 0.0, std::sin(phase)}), Eigen::Vector3d::Zero()};
      trembles[i].pose.translation += test::random_vector(rng, 0.003);
    }
    for (const Trajectory& b : {walks, turns}) {  // and come back to where A is
      const auto c = compare_trajectories({"", a, {}}, {"", b, {}}, {});
      ASSERT_TRUE(c) << c.error().message;
      EXPECT_TRUE(c->explanation.disagrees());
      EXPECT_FALSE(c->constraints.empty());
      EXPECT_LT(c->after.rmse_m, 0.1);
      EXPECT_LT(c->after.rmse_deg, 2.0);
    }
    EXPECT_FALSE(compare_trajectories({"", a, {}}, {"", trembles, {}}, {})->explanation.disagrees());
  }
}

TEST(CompareTrajectories, ManyMotionsBesideAStandingAStayFew) {
  Trajectory still;
  Trajectory far;
  for (int i = 0; i < 20'000; ++i) {  // two kilometres around a place that A never leaves
    still.push_back({Timestamp{} + 0.1 * i, {}});
    far.push_back({Timestamp{} + 0.1 * i, {so3_exp({0.0, 0.0, 0.01 * i}), {10.0 * std::cos(0.01 * i), 0.1 * i, 0.0}}});
  }
  const auto c = compare_trajectories({"", still, {}}, {"", far, {}}, {});
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_TRUE(c->explanation.disagrees());
  EXPECT_LE(c->judge.size(), 2000U);
}

TEST(CompareTrajectories, RefusesWhatCannotBeCompared) {
  const Trajectory truth = winding(10.0);
  Trajectory later = truth;
  for (auto& p : later) p.stamp = p.stamp + 1000.0;
  const auto never = compare_trajectories({"", truth, {}}, {"", later, {}}, {});
  ASSERT_FALSE(never);
  EXPECT_NE(never.error().message.find("1005.000 to 1015.000 s"), std::string::npos) << never.error().message;
  EXPECT_FALSE(compare_trajectories({"", truth, {}}, {"", {truth[3]}, {}}, {}));
  EXPECT_FALSE(compare_trajectories({"", {}, {}}, {"", truth, {}}, {}));
  NamedTrajectory singular{"", truth, std::vector<Matrix6d>(truth.size() - 1, Matrix6d::Zero())};
  EXPECT_FALSE(compare_trajectories({"", truth, {}}, singular, {}));
  // Two poses are enough; so is standing still.
  EXPECT_TRUE(compare_trajectories({"", truth, {}}, {"", {truth[3], truth[9]}, {}}, {}));
  Trajectory still = truth;
  for (auto& p : still) p.pose = {};
  const auto rest = compare_trajectories({"", still, {}}, {"", still, {}}, {});
  ASSERT_TRUE(rest);
  EXPECT_FALSE(rest->explanation.disagrees());
}

TEST(CompareTrajectories, RealOdometryAgainstGroundTruth) {
  TUTTI_REQUIRE_SHARED("data/euroc/MH_03/groundtruth.tum");
  const auto read = [](const char* name) {
    return formats::read_trajectory(test::shared_path(std::string("data/euroc/MH_03/") + name)).value();
  };
  const auto c = compare_trajectories({"", read("groundtruth.tum"), {}}, {"", read("rpg_vio_mono.tum"), {}},
                                      {.tolerance_m = 0.02, .tolerance_deg = std::atan(0.02 / 5.0) / kRadPerDeg});
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_TRUE(c->explanation.disagrees());
  // docs/compare.md: as near as was asked, not nearer, and with as few links as that takes.
  EXPECT_LE(c->after.rmse_m, 0.9 * 0.02);
  EXPECT_GE(c->after.rmse_m, 0.5 * 0.02);
  EXPECT_NEAR(static_cast<double>(c->constraints.size()), 67.0, 5.0);
}

}  // namespace compare_trajectories_test
}  // namespace tutti::mission
