// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/start_tries.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tutti/geometry/so3.hpp"

namespace tutti::localise {
namespace start_tries_test {

/// One submap a floor, along x; the second floor is 4 m above the first, and sloped.
KnownMap two_floors() {
  KnownMap map;
  for (const std::uint32_t floor : {0U, 1U}) {
    Submap submap;
    submap.id = {{{floor}, 0}, 0};
    for (std::uint32_t k = 0; k < 10; ++k)
      submap.keyframes.push_back(
          {.index = k, .stamp = {}, .T_odom_body = {Eigen::Quaterniond::Identity(), {1.0 * k, 0, 0}}});
    KnownMap::Entry entry{
        .submap = std::make_shared<const Submap>(submap), .T_world_submap = {}, .place = {}, .size = {}};
    entry.T_world_submap = {so3_exp({0, -0.1 * floor, 0}), {0, 0, 4.0 * floor}};
    map.submaps.emplace(submap.id, entry);
  }
  return map;
}

StartPose on_plan(double x, double y, double radians, double sigma_m, double sigma_rad) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance(0, 0) = covariance(1, 1) = sigma_m * sigma_m;
  covariance(5, 5) = sigma_rad * sigma_rad;
  return {RelativePose{{so3_exp({0, 0, radians}), {x, y, 0}}, covariance}, true};
}

TEST(StartTries, EachFloorOfAPlanIsTriedAsItsRobotsStoodThere) {
  const auto tries = tries_of(two_floors(), on_plan(5.0, 1.0, 1.5, 0.2, 0.1));
  ASSERT_TRUE(tries.has_value());
  ASSERT_EQ(tries->size(), 2U);
  EXPECT_NEAR(tries->at(0).T_world_body.T_a_b.translation.z(), 0.0, 1e-9);
  EXPECT_NEAR(tries->at(1).T_world_body.T_a_b.translation.z(), 4.0 + 5.0 * std::sin(0.1), 0.1);
  const Eigen::Vector3d up = tries->at(1).T_world_body.T_a_b.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_LT((up - so3_exp({0, -0.1, 0}) * Eigen::Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(StartTries, WithinTwoStandardDeviationsEveryPoseIsNearATry) {
  constexpr double kSigma_m = 1.0, kSigma_rad = 20.0 * kRadPerDeg;
  const StartPose start = on_plan(5.0, 0.0, 0.3, kSigma_m, kSigma_rad);
  const auto tries = tries_of(two_floors(), start);
  ASSERT_TRUE(tries.has_value());
  EXPECT_LE(tries->front().from.size(), kMostTries);
  for (const double along : {-2.0, -0.9, 0.0, 0.6, 1.4, 2.0})
    for (const double across : {-2.0, -0.5, 1.2})
      for (const double turns : {-2.0, -1.1, 0.0, 0.4, 2.0}) {
        const Pose3 wanted = tries->front().T_world_body.T_a_b *
                             Pose3{so3_exp({0, 0, turns * kSigma_rad}), {along * kSigma_m, across * kSigma_m, 0}};
        EXPECT_TRUE(std::ranges::any_of(tries->front().from,
                                        [&](const Pose3& from) {
                                          const Vector6d apart = local(from, wanted);
                                          return apart.head<3>().cwiseAbs().maxCoeff() < 1.06 &&
                                                 std::abs(apart[5]) < 7.6 * kRadPerDeg;
                                        }))
            << along << " " << across << " " << turns;
      }
}

TEST(StartTries, ManyAreBoundedAndTheNearestStay) {
  const auto tries = tries_of(two_floors(), on_plan(5.0, 0.0, 0.0, 2.9, 3.0));
  ASSERT_TRUE(tries.has_value());
  EXPECT_EQ(tries->front().from.size(), kMostTries);
  EXPECT_LT(local(tries->front().from.front(), tries->front().T_world_body.T_a_b).norm(), 1e-9);
}

}  // namespace start_tries_test
}  // namespace tutti::localise
