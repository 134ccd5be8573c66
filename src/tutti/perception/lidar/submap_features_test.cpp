// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/submap_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/model/path_length.hpp"
#include "tutti/perception/lidar/levelling.hpp"

namespace tutti::lidar {
namespace submap_features_test {

using namespace test;
constexpr double kDegree = 0.017453292519943295;
constexpr SubmapId kId{RobotId{0}, 3};

/// Angle between what the features call up and the world's up, degrees.
double tilt_error_deg(const SubmapFeatures& features, const Walk& walk) {
  const Eigen::Vector3d up = features.R_level_submap.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d truth = pose_on(walk, 0).rotation.conjugate() * Eigen::Vector3d::UnitZ();
  return std::acos(std::min(1.0, up.dot(truth))) / kDegree;
}

TEST(ExtractFeatures, levelsATiltedBodyInATiltedOdometryFrame) {
  for (const double tilt_deg : {0.0, 10.0, 40.0}) {
    const Walk walk{.tilt_rad = tilt_deg * kDegree, .T_odom_world = {so3_exp({0.03, -0.04, 2.0}), {20, 30, 1}}};
    const auto features = extract_features(make_submap(kId, furnished_room(), walk, Rng(1)), {});
    ASSERT_TRUE(features.usable) << to_string(*features.refusal);
    EXPECT_LT(tilt_error_deg(features, walk), 0.2) << tilt_deg;
  }
}

TEST(ExtractFeatures, believesTheBodyWhereTheOdometryFrameIsTippedOver) {
  const Walk walk{.tilt_rad = 4.0 * kDegree,
                  .T_odom_world = {so3_exp({35.0 * kDegree, 0, 0}), Eigen::Vector3d::Zero()}};
  const auto features = extract_features(make_submap(kId, furnished_room(), walk, Rng(1)), {});
  EXPECT_LT(tilt_error_deg(features, walk), 0.2);
}

TEST(RefineUp, keepsThePriorWhenTheSurfacesSayNothing) {
  const std::vector<Eigen::Vector3f> one_wall(100, Eigen::Vector3f(1, 0, 0));  // free to turn about x
  const Eigen::Vector3d prior = Eigen::Vector3d(0, 0.1, 1).normalized();
  EXPECT_LT((refine_up(one_wall, prior).up - prior).norm(), 1e-12);
  EXPECT_LT((refine_up({}, prior).up - prior).norm(), 1e-12);
  EXPECT_EQ(refine_up({}, prior).support, 0.0);
}

TEST(ExtractFeatures, sameInputGivesTheSameBits) {
  const Submap submap = make_submap(kId, furnished_room(), {}, Rng(2));
  const auto a = extract_features(submap, {}), b = extract_features(submap, {});
  EXPECT_EQ(*a.cloud.normals, *b.cloud.normals);
  EXPECT_EQ(a.R_level_submap.coeffs(), b.R_level_submap.coeffs());
  ASSERT_EQ(a.view.walls.size(), b.view.walls.size());
  for (std::size_t i = 0; i < a.view.walls.size(); ++i) {
    EXPECT_EQ(a.view.walls[i].position, b.view.walls[i].position);
    EXPECT_EQ(a.view.walls[i].normal, b.view.walls[i].normal);
  }
}

TEST(ExtractFeatures, doNotDependOnTheOrderOfTheCloud) {
  Submap submap = make_submap(kId, furnished_room(), {}, Rng(2));
  const auto before = extract_features(submap, {});
  auto cloud = *submap.cloud;
  std::reverse(cloud.points.begin(), cloud.points.end());
  submap.cloud = std::make_shared<PointCloud>(cloud);
  EXPECT_EQ(*extract_features(submap, {}).cloud.normals, *before.cloud.normals);
}

TEST(ExtractFeatures, saysWhyASubmapIsNotUsable) {
  const auto reason = [](const Submap& s) {
    const auto features = extract_features(s, {});
    EXPECT_FALSE(features.usable);
    return to_string(features.refusal.value());
  };
  const Submap good = make_submap(kId, furnished_room(), {}, Rng(1));
  Submap bad = good;
  bad.cloud = nullptr;
  EXPECT_EQ(reason(bad), "too small: 0 points, at least 500 needed");
  bad.cloud = std::make_shared<PointCloud>(PointCloud{{{1, 2, 3}}});
  EXPECT_EQ(reason(bad), "too small: 1 points, at least 500 needed");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  bad.cloud = std::make_shared<PointCloud>(PointCloud{std::vector<Eigen::Vector3f>(1000, {nan, 0, 0})});
  EXPECT_EQ(reason(bad), "too small: 0 points, at least 500 needed");
  EXPECT_EQ(reason(make_submap(kId, furnished_room(), {.keyframes = 4}, Rng(1))),
            "too few keyframes: 4 keyframes, at least 6 needed");
  bad = good;
  for (auto& keyframe : bad.keyframes) keyframe.stamp.ns /= 4;
  EXPECT_EQ(reason(bad), "too short: 2.5 s, at least 5.0 needed");
}

// By car a submap ends by its distance after 3 s. Short submaps lack motion.
TEST(ExtractFeatures, AFewSecondsAreEnoughWhereTheyLeadFar) {
  Submap fast = make_submap(kId, furnished_room(), {}, Rng(1));
  for (auto& keyframe : fast.keyframes) keyframe.stamp.ns /= 4;
  EXPECT_FALSE(extract_features(fast, {}).usable);
  LidarClosureConfig config;
  config.min_distance_m = path_length_m(fast.odometry);
  EXPECT_TRUE(extract_features(fast, config).usable);
}

}  // namespace submap_features_test
}  // namespace tutti::lidar
