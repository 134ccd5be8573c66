// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/visibility.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::lidar {
namespace visibility_test {

constexpr float kSpacing = 0.3F;

/// A wall at x = `distance`, 6 m wide and 3 m high, as seen from the origin.
OrientedCloud wall_at(float distance) {
  std::vector<Eigen::Vector3f> points;
  for (float y = -3.0F; y <= 3.0F; y += kSpacing)
    for (float z = -1.5F; z <= 1.5F; z += kSpacing) points.emplace_back(distance, y, z);
  return orient(points, {}, {});
}

TEST(DepthPanorama, seesTheNearestSurfaceAndNothingElsewhere) {
  const OrientedCloud near = wall_at(5.0F), far = wall_at(8.0F);
  auto points = near.index->points();
  points.insert(points.end(), far.index->points().begin(), far.index->points().end());
  const DepthPanorama view(orient(points, {}, {}), Eigen::Vector3f::Zero(), kSpacing);
  EXPECT_NEAR(view.depth_towards({10, 0, 0}), 5.0F, 0.2F);
  EXPECT_NEAR(view.depth_towards({5, 2, 0}), std::hypot(5.0F, 2.0F), 0.3F);
  EXPECT_EQ(view.depth_towards({-1, 0, 0}), 0.0F);
  EXPECT_EQ(view.depth_towards({0, 0, 9}), 0.0F);
}

TEST(DepthPanorama, leavesNoHolesInANearSurface) {
  const DepthPanorama view(wall_at(1.0F), Eigen::Vector3f::Zero(), kSpacing);
  for (float y = -1.0F; y < 1.0F; y += 0.01F)
    for (float z = -1.0F; z < 1.0F; z += 0.05F) ASSERT_GT(view.depth_towards({1.0F, y, z}), 0.0F) << y << " " << z;
}

TEST(CountVisible, countsWhatStandsWhereOneLookedThrough) {
  const std::vector<DepthPanorama> views{DepthPanorama(wall_at(5.0F), Eigen::Vector3f::Zero(), kSpacing)};
  const auto count = [&](const OrientedCloud& source) { return count_visible(views, source, {}, 100000, 0.5F); };
  const auto same = count(wall_at(5.0F)), nearer = count(wall_at(3.0F)), behind = count(wall_at(7.0F));
  EXPECT_GT(same.seen, 100);
  EXPECT_EQ(same.contradicting, 0);
  EXPECT_EQ(nearer.seen, 0);
  EXPECT_GT(nearer.contradicting, 100);
  EXPECT_EQ(behind.seen, 0);
  EXPECT_EQ(behind.contradicting, 0);
}

}  // namespace visibility_test
}  // namespace tutti::lidar
