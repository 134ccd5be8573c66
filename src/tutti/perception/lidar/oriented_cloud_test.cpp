// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/oriented_cloud.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "tutti/base/random.hpp"

namespace tutti::lidar {
namespace oriented_cloud_test {

std::vector<Eigen::Vector3f> random_points(Rng& rng, std::size_t n) {
  std::vector<Eigen::Vector3f> points;
  const auto coordinate = [&] { return static_cast<float>(rng.uniform(-2, 2)); };
  for (std::size_t i = 0; i < n; ++i) points.emplace_back(coordinate(), coordinate(), coordinate());
  return points;
}

RC_GTEST_PROP(NeighbourIndex, agreesWithTryingAllPoints, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto points = random_points(rng, 1 + rng.index(80));
  const NeighbourIndex index(points);
  for (const auto& query : random_points(rng, 20)) {
    const auto distance = [&](const Eigen::Vector3f& p) { return (p - query).norm(); };
    const auto best = std::min_element(points.begin(), points.end(),
                                       [&](const auto& p, const auto& q) { return distance(p) < distance(q); });
    const float radius = static_cast<float>(rng.uniform(0.05, 2.0));
    const auto guess = static_cast<std::int32_t>(rng.index(points.size()));
    RC_ASSERT(index.nearest(query, radius, guess) == index.nearest(query, radius));
    const auto found = index.nearest(query, radius);
    if (distance(*best) < radius)
      RC_ASSERT(found == static_cast<std::int32_t>(best - points.begin()));
    else
      RC_ASSERT(found == NeighbourIndex::kNone);
  }
}

TEST(NeighbourIndex, nearestKIsSortedAndShortWhenThereAreFewPoints) {
  const NeighbourIndex index({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}});
  std::int32_t out[5];
  ASSERT_EQ(index.nearest_k({0.9F, 0, 0}, out), 3U);
  EXPECT_EQ(out[0], 1);
  EXPECT_EQ(out[1], 0);
  EXPECT_EQ(out[2], 2);
}

TEST(NeighbourIndex, hasNothingWhenEmpty) {
  const NeighbourIndex index({});
  std::int32_t out[2];
  EXPECT_EQ(index.nearest({0, 0, 0}, 10.0F), NeighbourIndex::kNone);
  EXPECT_EQ(index.nearest_k({0, 0, 0}, out), 0U);
}

TEST(Orient, planeNormalsFaceTheViewpointOnEitherSide) {
  std::vector<Eigen::Vector3f> plane;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) plane.emplace_back(0.2F * static_cast<float>(i), 0.2F * static_cast<float>(j), 1.0F);
  for (const float height : {0.0F, 2.0F}) {
    const Eigen::Vector3f viewpoint(2, 2, height);
    const auto cloud = orient(plane, {&viewpoint, 1}, {});
    for (std::size_t i = 0; i < cloud.size(); ++i) EXPECT_NEAR(cloud.normal(i).z(), height - 1.0F, 1e-4F);
  }
}

TEST(Orient, givesNoNormalWhereThePointsAreNotFlat) {
  Rng rng(1);
  const auto cloud = orient(random_points(rng, 500), {}, {});  // a filled cube
  const auto flat =
      std::count_if(cloud.normals->begin(), cloud.normals->end(), [](const auto& n) { return n.norm() > 0; });
  EXPECT_LT(flat, 200);
  EXPECT_EQ(orient({}, {}, {}).size(), 0U);
  EXPECT_EQ(orient({{1, 2, 3}}, {}, {}).normal(0), Eigen::Vector3f(0, 0, 0));
}

}  // namespace oriented_cloud_test
}  // namespace tutti::lidar
