// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/cloud_distance.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"

namespace tutti::evaluation {
namespace cloud_distance_test {

PointCloud random_cloud(std::size_t size, Rng rng) {
  PointCloud cloud;
  for (std::size_t i = 0; i < size; ++i)
    cloud.points.emplace_back(static_cast<float>(rng.uniform(-20.0, 20.0)),
                              static_cast<float>(rng.uniform(-20.0, 20.0)), static_cast<float>(rng.uniform(-3.0, 3.0)));
  return cloud;
}

/// A wall: one point every `step_m` of a vertical plane.
PointCloud wall(double step_m) {
  PointCloud cloud;
  for (double x = 0.0; x < 10.0; x += step_m)
    for (double z = 0.0; z < 3.0; z += step_m)
      cloud.points.emplace_back(static_cast<float>(x), 0.0F, static_cast<float>(z));
  return cloud;
}

float nearest_point(const PointCloud& cloud, const Eigen::Vector3f& p) {
  float nearest = std::numeric_limits<float>::infinity();
  for (const auto& q : cloud.points) nearest = std::min(nearest, (q - p).norm());
  return nearest;
}

RC_GTEST_PROP(CloudDistance, IsToTheNearestPointWhereThereAreNoPlanes, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const PointCloud a = random_cloud(1 + seed % 3, Rng(seed));
  const PointCloud b = random_cloud(50, Rng(seed).fork("b"));
  const auto found = CloudIndex(a).distances(b);
  RC_ASSERT(found.size() == b.points.size());
  for (std::size_t i = 0; i < b.points.size(); ++i)
    RC_ASSERT(std::abs(found[i] - nearest_point(a, b.points[i])) < 1e-4F);
}

RC_GTEST_PROP(CloudDistance, IsNeverMoreThanToTheNearestPoint, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const PointCloud a = random_cloud(1 + seed % 200, Rng(seed));
  const PointCloud b = random_cloud(50, Rng(seed).fork("b"));
  const auto found = CloudIndex(a).distances(b);
  for (std::size_t i = 0; i < b.points.size(); ++i) RC_ASSERT(found[i] < nearest_point(a, b.points[i]) + 1e-4F);
}

TEST(CloudDistance, MovesTheCloudFirst) {
  const PointCloud a = random_cloud(300, Rng(3));
  Rng rng(4);
  const Pose3 T_a_b = test::random_pose(rng, 30.0);
  PointCloud b;
  for (const auto& p : a.points) b.points.push_back((T_a_b.inverse() * p.cast<double>().eval()).cast<float>());
  for (const float d : CloudIndex(a).distances(b, T_a_b)) EXPECT_LT(d, 1e-4F);
}

TEST(CloudDistance, AShiftedWallIsOffByTheShift) {
  const PointCloud survey = wall(0.05);
  const Pose3 shifted{Eigen::Quaterniond::Identity(), {0.0, 0.25, 0.0}};
  const auto distance = summarise(CloudIndex(survey).distances(survey, shifted));
  ASSERT_TRUE(distance);
  EXPECT_EQ(distance->points, survey.points.size());
  EXPECT_NEAR(distance->mean_m, 0.25, 1e-5);
  EXPECT_NEAR(distance->rms_m, 0.25, 1e-5);
  EXPECT_NEAR(distance->p95_m, 0.25, 1e-5);
  EXPECT_EQ(distance->within_10cm, 0.0);
  EXPECT_EQ(distance->within_30cm, 1.0);
}

TEST(CloudDistance, SpacingOfTheSurveyDoesNotMatterOnAWall) {
  Rng rng(8);
  PointCloud seen;  // 3 cm in front of the wall, anywhere
  for (int i = 0; i < 4000; ++i)
    seen.points.emplace_back(static_cast<float>(rng.uniform(0.5, 9.5)), 0.03F,
                             static_cast<float>(rng.uniform(0.5, 2.5)));
  for (const double step_m : {0.05, 0.2})
    for (const float d : CloudIndex(wall(step_m)).distances(seen)) EXPECT_NEAR(d, 0.03F, 1e-5F);
}

TEST(CloudDistance, AWallEndsWhereItsPointsEnd) {
  const PointCloud survey = wall(0.1);
  const PointCloud beside{{{-3.0F, 0.0F, 1.0F}, {5.0F, 0.0F, 8.0F}}};
  const auto distances = CloudIndex(survey).distances(beside);
  EXPECT_NEAR(distances[0], 3.0F, 0.3F);
  EXPECT_NEAR(distances[1], 5.1F, 0.3F);
}

TEST(CloudDistance, AnEdgeIsNotAPlane) {
  PointCloud survey = wall(0.1);
  for (const auto& p : wall(0.1).points) survey.points.emplace_back(0.0F, p.x(), p.z());  // the wall at a right angle
  const PointCloud corner{{{-0.2F, -0.2F, 1.0F}}};                                        // behind both
  EXPECT_NEAR(CloudIndex(survey).distances(corner)[0], std::hypot(0.2F, 0.2F), 0.09F);
}

TEST(CloudDistance, SummaryOfKnownDistances) {
  std::vector<float> distances;
  for (int i = 1; i <= 100; ++i) distances.push_back(0.02F * static_cast<float>(i));
  distances.push_back(std::numeric_limits<float>::quiet_NaN());
  const auto summary = summarise(distances);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->points, 100U);
  EXPECT_NEAR(summary->mean_m, 1.01, 1e-6);
  EXPECT_NEAR(summary->rms_m, 0.02 * std::sqrt(338350.0 / 100.0), 1e-6);
  EXPECT_NEAR(summary->p95_m, 1.9, 1e-6);
  EXPECT_NEAR(summary->within_10cm, 0.05, 1e-9);
  EXPECT_NEAR(summary->within_30cm, 0.15, 1e-9);
  EXPECT_NEAR(summary->within_1m, 0.5, 1e-9);
}

TEST(CloudDistance, NothingToMeasure) {
  EXPECT_FALSE(summarise({}));
  EXPECT_FALSE(summarise(CloudIndex({}).distances(wall(0.5))));
  EXPECT_TRUE(CloudIndex(wall(0.5)).distances({}).empty());
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const PointCloud broken{{{kNaN, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}}};
  const auto distances = CloudIndex(broken).distances(broken);
  EXPECT_TRUE(std::isnan(distances[0]));
  EXPECT_EQ(distances[1], 0.0F);
}

}  // namespace cloud_distance_test
}  // namespace tutti::evaluation
