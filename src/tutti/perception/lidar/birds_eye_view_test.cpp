// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/birds_eye_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {
namespace birds_eye_view_test {

using namespace test;

/// Between two directions that are the same after half a turn.
double apart_deg(double a, double b) { return std::abs(std::remainder(a - b, std::numbers::pi)) / kRadPerDeg; }

SubmapFeatures features_of(const Walk& walk, std::uint64_t seed) {
  return extract_features(make_submap({RobotId{0}, 0}, furnished_room(), walk, Rng(seed)), {});
}

TEST(WallDirections, areThoseOfTheRoomWhateverTheYaw) {
  for (const double yaw_deg : {0.0, 1.0, 44.0, 45.5, 90.0, 137.0, 179.9}) {
    const auto directions = wall_directions(features_of({.yaw_rad = yaw_deg * kRadPerDeg}, 1).view, 2);
    ASSERT_EQ(directions.size(), 2U);
    for (const double direction : directions) {
      EXPECT_GE(direction, 0.0);
      EXPECT_LT(direction, std::numbers::pi + 0.01);
      EXPECT_LT(std::min(apart_deg(direction, -yaw_deg * kRadPerDeg),
                         apart_deg(direction, 0.5 * std::numbers::pi - yaw_deg * kRadPerDeg)),
                0.3)
          << yaw_deg;
    }
    EXPECT_NEAR(apart_deg(directions[0], directions[1]), 90.0, 0.5);
  }
}

TEST(WallDirections, noneWithoutWalls) {
  EXPECT_TRUE(wall_directions({}, 2).empty());
  EXPECT_TRUE(turn_views({}, {}).empty());
}

TEST(TurnViews, wavelengthsCountAlikeAndTogetherOne) {
  const auto features = features_of({.yaw_rad = 1.0}, 2);
  ASSERT_EQ(features.turned_views->size(), 2U);
  for (const TurnedView& view : *features.turned_views) {
    const auto size = [&](int row, int column) { return std::abs(view.spectrum(row, column)); };
    EXPECT_NEAR(view.spectrum.abs2().sum(), 1.0, 1e-4);
    EXPECT_NEAR(size(2, 3) / size(3, 2), 1.0, 1e-3);
    EXPECT_GT(size(1, 1), 2.0 * size(kImageSize / 2, kImageSize / 2));
  }
}

TEST(FloorPatch, putsTheTwoSidesOfASlabApart) {
  EXPECT_EQ(floor_patch({0.1F, 0.1F}, true, 0.8), floor_patch({1.5F, 1.5F}, true, 0.8));
  EXPECT_NE(floor_patch({0.1F, 0.1F}, true, 0.8), floor_patch({0.1F, 0.1F}, false, 0.8));
  EXPECT_NE(floor_patch({0.1F, 0.1F}, true, 0.8), floor_patch({-0.1F, 0.1F}, true, 0.8));
}

}  // namespace birds_eye_view_test
}  // namespace tutti::lidar
