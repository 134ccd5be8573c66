// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/verify.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <map>
#include <numbers>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::lidar {
namespace verify_test {

using namespace test;
const LidarClosureConfig kConfig;

struct Side {
  Submap submap;
  SubmapFeatures features;
};
Side see(SubmapId id, const World& world, const Walk& walk, std::uint64_t seed) {
  Submap submap = make_submap(id, world, walk, Rng(seed));
  auto features = extract_features(submap, kConfig);
  return {std::move(submap), std::move(features)};
}

const Walk kWalkA{.T_odom_world = {so3_exp({0.02, 0.01, 0.4}), {3, 4, 5}}};
const Walk kWalkB{.from = {10, 4.5, 1.5},
                  .to = {6, 4.5, 1.5},
                  .yaw_rad = 2.5,
                  .tilt_rad = 0.15,
                  .T_odom_world = {so3_exp({-0.03, 0.02, -2.0}), {-40, 20, 0}}};

TEST(VerifyPair, acceptsTheSameRoomAndFindsThePose) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 0}, furnished_room(), kWalkB, 2);
  const auto v = verify_pair(a.features, b.features, kConfig);
  ASSERT_TRUE(v.accepted) << to_string(*v.refusal);
  const Vector6d error = local(true_relative(kWalkA, kWalkB), v.T_a_b);
  EXPECT_LT(error.head<3>().norm(), 0.02);
  EXPECT_LT(error.tail<3>().norm(), 0.002);
  EXPECT_GT(v.overlap, 0.7);
  EXPECT_LT(v.contradiction, 0.1);
}

TEST(VerifyPair, findsARobotWhoseUpIsTheOthersDown) {
  Walk over = kWalkB;
  over.T_odom_world = {so3_exp({std::numbers::pi - 0.03, 0, 0}) * so3_exp({0, 0, -2.0}), {-40, 20, 0}};
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1);
  for (const std::uint32_t index : {0U, 1U}) {
    const Side b = see({RobotId{1}, index}, furnished_room(), over, 2);
    const auto v = verify_pair(a.features, b.features, kConfig);
    EXPECT_EQ(v.accepted, index == 0) << "an eighth of the pairs that are refused upright are tried";
    if (!v.accepted) continue;
    const Vector6d error = local(true_relative(kWalkA, over), v.T_a_b);
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.002);
  }
}

TEST(VerifyPair, aRobotIsNeverUpsideDownToItself) {
  Walk over = kWalkB;
  over.T_odom_world = {so3_exp({std::numbers::pi - 0.03, 0, 0}) * so3_exp({0, 0, -2.0}), {-40, 20, 0}};
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1), b = see({RobotId{0}, 8}, furnished_room(), over, 2);
  EXPECT_FALSE(verify_pair(a.features, b.features, kConfig).accepted);
}

TEST(VerifyPair, swappingTheSubmapsInvertsTheResult) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 0}, furnished_room(), kWalkB, 2);
  const auto ab = verify_pair(a.features, b.features, kConfig), ba = verify_pair(b.features, a.features, kConfig);
  ASSERT_TRUE(ab.accepted && ba.accepted);
  EXPECT_LT(local(ab.T_a_b, ba.T_a_b.inverse()).norm(), 1e-12);
  const PairVerification back = inverse(ba);
  EXPECT_TRUE(back.covariance.isApprox(ab.covariance, 1e-9));
}

TEST(VerifyPair, sameInputGivesTheSameBits) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 0}, furnished_room(), kWalkB, 2);
  const auto one = verify_pair(a.features, b.features, kConfig), two = verify_pair(a.features, b.features, kConfig);
  EXPECT_EQ(one.T_a_b, two.T_a_b);
  EXPECT_EQ(one.covariance, two.covariance);
}

TEST(VerifyPair, refusesAnotherRoom) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Walk walk{.from = {2, 2 + 0.5 * static_cast<double>(seed), 1},
                    .to = {6, 3, 1},
                    .yaw_rad = 1.0 + 0.4 * static_cast<double>(seed)};
    const Side b = see({RobotId{1}, 0}, other_room(), walk, seed);
    const auto v = verify_pair(a.features, b.features, kConfig);
    EXPECT_FALSE(v.accepted);
    EXPECT_TRUE(v.refusal.has_value());
  }
}

TEST(VerifyPair, refusesTheMirrorImage) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1);
  const Walk walk{.from = {-2, 5, 1.2}, .to = {-6, 5, 1.2}, .yaw_rad = 3.0};
  const Side b = see({RobotId{1}, 0}, mirrored(furnished_room()), walk, 2);
  EXPECT_FALSE(verify_pair(a.features, b.features, kConfig).accepted);
}

TEST(VerifyPair, refusesACorridorAsFreeToSlide) {
  const Side a = see({RobotId{0}, 0}, corridor(), {.from = {20, 1.3, 1.2}, .to = {24, 1.3, 1.2}}, 1);
  for (const double x : {22.0, 50.0}) {  // the same segment, and another one that looks the same
    const Side b = see({RobotId{1}, 0}, corridor(), {.from = {x, 1.3, 1.2}, .to = {x + 4, 1.3, 1.2}}, 2);
    const auto v = verify_pair(a.features, b.features, kConfig);
    EXPECT_FALSE(v.accepted);
    EXPECT_LT(v.min_eigenvalue, kConfig.min_eigenvalue);
  }
}

TEST(VerifyPair, refusesAnEmptyRectangleAsAmbiguous) {
  World room;
  add_box(room, {0, 0, 0}, {14, 9, 3});  // half a turn maps it onto itself
  const Side a = see({RobotId{0}, 0}, room, kWalkA, 1), b = see({RobotId{1}, 0}, room, kWalkB, 2);
  const auto v = verify_pair(a.features, b.features, kConfig);
  EXPECT_FALSE(v.accepted);
  EXPECT_GT(v.rival_ratio, kConfig.max_rival_ratio);
}

TEST(VerifyPair, refusesViewpointsFartherApartThanAskedFor) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 0}, furnished_room(), kWalkB, 2);
  LidarClosureConfig config;
  const double apart = verify_pair(a.features, b.features, config).viewpoint_distance_m;
  EXPECT_NEAR(apart, (pose_on(kWalkA, 5).translation - pose_on(kWalkB, 5).translation).norm(), 0.05);
  config.max_viewpoint_distance_m = apart + 0.1;
  EXPECT_TRUE(verify_pair(a.features, b.features, config).accepted);
  config.max_viewpoint_distance_m = apart - 0.1;
  EXPECT_FALSE(verify_pair(a.features, b.features, config).accepted);
}

TEST(VerifyPair, refusesACorridorWithNothingButAFarEndAsAmbiguous) {
  World world = corridor();
  world.push_back({{80, 0, 0}, {0, 2.6, 0}, {0, 0, 2.5}});  // the end wall
  LidarClosureConfig config;
  config.min_eigenvalue = 0.0;  // only sliding may refuse
  const Side a = see({RobotId{0}, 0}, world, {.from = {20, 1.3, 1.2}, .to = {24, 1.3, 1.2}}, 1);
  const Side b = see({RobotId{1}, 0}, world, {.from = {40, 1.3, 1.2}, .to = {44, 1.3, 1.2}}, 2);
  EXPECT_FALSE(verify_pair(a.features, b.features, config).accepted);
}

TEST(VerifyPair, refusesUnusableSubmapsWithTheirReason) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1);
  Side b = see({RobotId{1}, 7}, furnished_room(), {.keyframes = 3}, 1);
  EXPECT_EQ(verify_pair(a.features, b.features, kConfig).refusal,
            (Refusal{RefusalReason::too_few_keyframes, 3.0, 6.0}));
}

TEST(VerifyPair, odometryNoiseInsideTheSubmapsEnlargesTheCovariance) {
  Walk walk_a = kWalkA, walk_b = kWalkB;
  Matrix6d last = Matrix6d::Zero();
  for (const double sigma : {1e-4, 1e-3, 1e-2}) {
    walk_a.odometry_sigma = walk_b.odometry_sigma = sigma;
    const auto v = verify_pair(see({RobotId{0}, 0}, furnished_room(), walk_a, 1).features,
                               see({RobotId{1}, 0}, furnished_room(), walk_b, 2).features, kConfig);
    ASSERT_TRUE(v.accepted) << to_string(*v.refusal);
    EXPECT_GT(eigen_of(Matrix6d(v.covariance - last)).values[0], 0.0) << sigma;
    last = v.covariance;
  }
}

/// As a sensor sees the room that errs alike on whole patches of this edge, from exact odometry.
SubmapFeatures see_with_patches(SubmapId id, Walk walk, double edge_m, std::uint64_t seed) {
  walk.odometry_sigma = 1e-6;
  Submap submap = make_submap(id, furnished_room(), walk, Rng(seed));
  PointCloud cloud = *submap.cloud;
  Rng rng = Rng(seed).fork("patches");
  std::map<std::array<int, 3>, Eigen::Vector3d> errors;
  for (Eigen::Vector3f& p : cloud.points) {
    const Eigen::Array3i patch = (p.cast<double>().array() / edge_m).floor().cast<int>();
    const auto [error, is_new] = errors.try_emplace({patch[0], patch[1], patch[2]});
    if (is_new) error->second = 0.02 * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
    p += error->second.cast<float>();
  }
  submap.cloud = std::make_shared<PointCloud>(std::move(cloud));
  return extract_features(submap, kConfig);
}

// However many neighbours err alike, their residuals measure how sure the closure is: normalised squared errors between
// 3 and 9, where 6 is exact.
TEST(VerifyPair, covarianceIsHonestHoweverManyNeighboursErrAlike) {
  LidarClosureConfig config;
  config.max_rival_ratio = 1.0;  // how sure, not whether
  for (const double edge_m : {0.01, 0.6}) {
    double nees = 0.0;
    constexpr int kRuns = 12;
    for (std::uint64_t run = 0; run < kRuns; ++run) {
      const auto v = verify_pair(see_with_patches({RobotId{0}, 0}, kWalkA, edge_m, 1000 + run),
                                 see_with_patches({RobotId{1}, 0}, kWalkB, edge_m, 2000 + run), config);
      ASSERT_TRUE(v.accepted) << to_string(*v.refusal);
      const Vector6d error = local(true_relative(kWalkA, kWalkB), v.T_a_b);
      nees += squared_distance(error, v.covariance) / kRuns;
    }
    EXPECT_GT(nees, 3.0) << edge_m;
    EXPECT_LT(nees, 9.0) << edge_m;
  }
}

TEST(VerifyNear, findsThePoseFromAnywhereNearIt) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 0}, furnished_room(), kWalkB, 2);
  const Pose3 truth = true_relative(kWalkA, kWalkB);
  const Pose3 guess = truth * Pose3{so3_exp({0.0, 0.0, 0.08}), {0.5, -0.4, 0.1}};
  const auto v = verify_near(a.features, b.features, guess, kConfig);
  ASSERT_TRUE(v.accepted) << to_string(*v.refusal);
  EXPECT_LT(local(truth, v.T_a_b).head<3>().norm(), 0.02);
  EXPECT_EQ(v.evidence.size(), 10U);
  const auto turned = verify_near(b.features, a.features, guess.inverse(), kConfig);
  EXPECT_LT(local(v.T_a_b, turned.T_a_b.inverse()).norm(), 1e-12);
}

TEST(VerifyNear, measuresWhatItRefuses) {
  const Side a = see({RobotId{0}, 0}, furnished_room(), kWalkA, 1), b = see({RobotId{1}, 0}, other_room(), kWalkB, 2);
  const auto v = verify_near(a.features, b.features, true_relative(kWalkA, kWalkB), kConfig);
  EXPECT_FALSE(v.accepted);
  ASSERT_TRUE(v.refusal.has_value());
  if (v.refusal->reason != RefusalReason::no_alignment) {
    EXPECT_EQ(v.evidence.size(), 10U);
  }
  const Pose3 far{Eigen::Quaterniond::Identity(), {500.0, 0.0, 0.0}};
  const auto none = verify_near(a.features, b.features, far, kConfig);
  EXPECT_EQ(none.refusal->reason, RefusalReason::no_alignment);
  EXPECT_TRUE(none.evidence.empty());
}

TEST(ToVerdict, closureJoinsTheMiddleKeyframesInWhicheverOrderThePairIsGiven) {
  const Side a = see({RobotId{0}, 2}, furnished_room(), kWalkA, 1),
             b = see({RobotId{1}, 1}, furnished_room(), kWalkB, 2);
  const auto ab = to_verdict(a.submap, b.submap, verify_pair(a.features, b.features, kConfig));
  const auto ba = to_verdict(b.submap, a.submap, verify_pair(b.features, a.features, kConfig));
  for (const auto& verdict : {ab, ba}) {
    EXPECT_EQ(verdict.pair, (SubmapPair{{RobotId{0}, 2}, {RobotId{1}, 1}}));
    ASSERT_EQ(verdict.closures.size(), 1U) << to_string(*verdict.refusal);
    EXPECT_EQ(verdict.closures[0].from, (KeyframeId{RobotId{0}, 205}));
    EXPECT_EQ(verdict.closures[0].to, (KeyframeId{RobotId{1}, 105}));
    const Pose3 truth = pose_on(kWalkA, 5).inverse() * pose_on(kWalkB, 5);
    EXPECT_LT(local(truth, verdict.closures[0].measurement.T_a_b).norm(), 0.03);
  }
}

TEST(ToVerdict, aRefusalCarriesItsReason) {
  const Submap a = make_submap({RobotId{0}, 0}, {}, {}, Rng(1)), b = make_submap({RobotId{1}, 0}, {}, {}, Rng(1));
  const Refusal refusal{RefusalReason::overlap, 0.1, 0.3};
  const auto verdict = to_verdict(b, a, {.refusal = refusal});
  EXPECT_TRUE(verdict.closures.empty());
  EXPECT_EQ(verdict.refusal, refusal);
  EXPECT_EQ(to_string(refusal), "overlap: 0.10, at least 0.30 needed");
  EXPECT_LT(verdict.pair.first, verdict.pair.second);
}

}  // namespace verify_test
}  // namespace tutti::lidar
