// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/rays.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti {
namespace rays_test {

Eigen::Vector3d any_vector(Rng& rng) { return {rng.normal(), rng.normal(), rng.normal()}; }

RC_GTEST_PROP(Rays, ThroughAPointMeetThere, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Eigen::Vector3d point = 5.0 * any_vector(rng);
  std::vector<Ray> rays;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d origin = point + 3.0 * any_vector(rng);
    rays.push_back({origin, (point - origin).normalized()});
  }
  const auto met = nearest_point(rays);
  RC_ASSERT(met.has_value());
  RC_ASSERT((*met - point).norm() < 1e-6);
}

TEST(Rays, TwoThatPassEachOtherMeetHalfway) {
  const std::vector<Ray> rays{{{0.0, 0.0, 1.0}, Eigen::Vector3d::UnitX()}, {{0.0, 0.0, 3.0}, Eigen::Vector3d::UnitY()}};
  EXPECT_LT((*nearest_point(rays) - Eigen::Vector3d(0.0, 0.0, 2.0)).norm(), 1e-12);
  EXPECT_NEAR(largest_angle(rays), std::acos(0.0), 1e-12);
}

TEST(Rays, NoneOrOneMeetNowhereAndHaveNoAngle) {
  EXPECT_FALSE(nearest_point({}).has_value());
  const std::vector<Ray> one{{{1.0, 2.0, 3.0}, Eigen::Vector3d::UnitX()}};
  EXPECT_FALSE(nearest_point(one).has_value());
  EXPECT_EQ(largest_angle(one), 0.0);
}

}  // namespace rays_test
}  // namespace tutti
